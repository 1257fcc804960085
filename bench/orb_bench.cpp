// Speed of the ORB extractor, of what looks features up, and of optical flow; *BesideOpenCv: both
// in turn, one thread (beside.hpp).
#include <benchmark/benchmark.h>

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/video/tracking.hpp>

#include "beside.hpp"
#include "features/feature_grid.hpp"
#include "features/matcher.hpp"
#include "features/orb.hpp"
#include "image/cv_view.hpp"
#include "motion/flow/lk_flow.hpp"
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

void BM_ExtractBesideOpenCv(benchmark::State& state) {
  cv::setNumThreads(1);
  const GreyImage image = render_texture(640, 480, 1);
  const OrbConfig config;
  OrbExtractor extractor{config};
  const auto theirs =
      cv::ORB::create(config.features, static_cast<float>(config.scale_factor), config.levels);
  std::vector<cv::KeyPoint> corners;
  cv::Mat descriptors;
  double ours_s = 0, opencv_s = 0;
  std::size_t found = 0;
  for (auto _ : state) {
    ours_s += seconds([&] { found = extractor.extract(image).size(); });
    opencv_s += seconds(
        [&] { theirs->detectAndCompute(cv_view(image), cv::noArray(), corners, descriptors); });
  }
  report(state, ours_s, "opencv", opencv_s);
  state.counters["features"] = static_cast<double>(found);
  state.counters["opencv_features"] = static_cast<double>(corners.size());
}
BENCHMARK(BM_ExtractBesideOpenCv)->Unit(benchmark::kMillisecond);

/// The current image's pyramid, and where a thousand corners of the previous image are in it.
void BM_FlowBesideOpenCv(benchmark::State& state) {
  cv::setNumThreads(1);
  Rng rng(6);
  const GreyImage before = render_texture(640, 480, 1);
  const Warp warp = make_warp("translation", 640, 480, rng);
  const GreyImage after = apply_warp(before, warp, rng);
  std::vector<Eigen::Vector2f> points;
  std::vector<cv::Point2f> cv_points;
  for (const Feature& f : extract_with_ours(before, 1000).points) {
    points.push_back(f.uv_px);
    cv_points.emplace_back(f.uv_px.x(), f.uv_px.y());
  }
  const FlowConfig config;
  const cv::Size window(config.window_px, config.window_px);
  const cv::TermCriteria end(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, config.max_iterations,
                             config.epsilon_px);
  const ImagePyramid previous(before, config.levels, config.window_px);
  std::vector<cv::Mat> cv_previous, cv_current;
  cv::buildOpticalFlowPyramid(cv_view(before), cv_previous, window, config.levels);
  std::vector<FlowPoint> flow;
  std::vector<cv::Point2f> cv_ends;
  std::vector<std::uint8_t> cv_found;
  double ours_s = 0, opencv_s = 0;
  for (auto _ : state) {
    ours_s += seconds([&] {
      flow = track_points(previous, ImagePyramid(after, config.levels, config.window_px), points,
                          {}, config);
    });
    opencv_s += seconds([&] {
      cv::buildOpticalFlowPyramid(cv_view(after), cv_current, window, config.levels);
      cv::calcOpticalFlowPyrLK(cv_previous, cv_current, cv_points, cv_ends, cv_found, cv::noArray(),
                               window, config.levels, end);
    });
  }
  report(state, ours_s, "opencv", opencv_s);
  const auto is_right = [&](std::size_t i, const Eigen::Vector2f& uv_px) {
    return (uv_px.cast<double>() - warp(points[i].cast<double>())).norm() < 0.5;
  };
  double right = 0, cv_right = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    right += flow[i].status == FlowStatus::kFound && is_right(i, flow[i].end_uv_px) ? 1 : 0;
    cv_right += cv_found[i] != 0 && is_right(i, {cv_ends[i].x, cv_ends[i].y}) ? 1 : 0;
  }
  state.counters["right"] = right;
  state.counters["opencv_right"] = cv_right;
}
BENCHMARK(BM_FlowBesideOpenCv)->Unit(benchmark::kMillisecond);

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
