// Speed and quality of the ORB extractor beside OpenCV's.
//   orb_bench [Google Benchmark's options]
//   orb_bench --table [SEQUENCE...]     repeatability and correct matches, see orb_table.hpp
#include <cstdlib>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <opencv2/core/utility.hpp>

#include "features/feature_grid.hpp"
#include "features/matcher.hpp"
#include "features/orb.hpp"
#include "orb_table.hpp"
#include "texture.hpp"

namespace ygslam::bench {
namespace {

Features extract_with_ours(const GreyImage& image, int count) {
  OrbConfig config;
  config.features = count;
  return OrbExtractor(config).extract(image);
}

void BM_ExtractOurs(benchmark::State& state) {
  const GreyImage image = render_texture(640, 480, 1);
  OrbExtractor extractor{OrbConfig{}};
  std::size_t found = 0;
  for (auto _ : state) found = extractor.extract(image).size();
  state.counters["features"] = static_cast<double>(found);
}
BENCHMARK(BM_ExtractOurs)->Unit(benchmark::kMillisecond);

void BM_ExtractOpenCv(benchmark::State& state) {
  const GreyImage image = render_texture(640, 480, 1);
  std::size_t found = 0;
  for (auto _ : state) found = extract_with_opencv(image, 1000).size();
  state.counters["features"] = static_cast<double>(found);
}
BENCHMARK(BM_ExtractOpenCv)->Unit(benchmark::kMillisecond);

void BM_MatchBruteForce(benchmark::State& state) {
  const Features a = extract_with_ours(render_texture(640, 480, 1), 1000);
  const Features b = extract_with_ours(render_texture(640, 480, 2), 1000);
  for (auto _ : state) benchmark::DoNotOptimize(match_brute_force(a, b));
}
BENCHMARK(BM_MatchBruteForce)->Unit(benchmark::kMillisecond);

void BM_GridSearch1000(benchmark::State& state) {
  const Features a = extract_with_ours(render_texture(640, 480, 1), 1000);
  const FeatureGrid grid(a, {0, 0, 639, 479});
  for (auto _ : state) {
    std::size_t found = 0;
    for (const Feature& f : a.points) {
      grid.visit(f.ideal_px, 15, 0, 7, [&](std::uint32_t) { ++found; });
    }
    benchmark::DoNotOptimize(found);
  }
}
BENCHMARK(BM_GridSearch1000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace ygslam::bench

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  if (argc >= 2 && std::string(argv[1]) == "--table") {
    return ygslam::bench::print_tables({{"OpenCV", ygslam::bench::extract_with_opencv},
                                        {"ours", ygslam::bench::extract_with_ours}},
                                       std::vector<std::string>(argv + 2, argv + argc), 1000, 10);
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
