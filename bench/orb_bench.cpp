// Speed of the ORB extractor and of what looks features up.
#include <benchmark/benchmark.h>

#include "features/feature_grid.hpp"
#include "features/matcher.hpp"
#include "features/orb.hpp"
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

BENCHMARK_MAIN();
