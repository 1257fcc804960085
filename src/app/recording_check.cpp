#include "app/recording_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "core/log.hpp"
#include "core/statistics.hpp"
#include "geometry/rolling_shutter.hpp"

namespace ygslam {
namespace {

// A wrong depth scale or camera shows in the depth itself: a room's median lies between these, and
// something in view is farther than the last. Over the recordings the bounds were tried on, medians
// are 0.9 to 5.0 m and the 99th percentile at least 1.6 m; at a fifth of the scale that is at most
// 1.3 m. At five times the scale the median of what stays in range is at least 4.7 m, and either
// nothing is near or much is out of range, unlike in a large room.
constexpr float kNearestMedian_m = 0.5F, kFarthestMedian_m = 4.3F, kNearestFar_m = 1.4F;
constexpr float kFarthestNear_m = 3.3F;  // 1st percentile
constexpr double kLeastValidShare = 0.1, kLeastOfLargeRoom = 0.65;

/// By how much more colour changes at edges of depth than elsewhere, as the images lie on each
/// other, and with depth turned over.
struct EdgeAgreement {
  double as_is = 0, upside_down = 0, mirrored = 0, turned = 0;
  int edges = 0;
};

bool is_step(float a_m, float b_m) {
  constexpr float kStep = 0.1F;
  return a_m > 0 && b_m > 0 && std::abs(a_m - b_m) > kStep * std::min(a_m, b_m);
}

Image<float> changes_of(const GreyImage& grey, int border_px) {
  constexpr int kReach_px = 2;
  constexpr int kMost = 60;  // of one edge: many weak ones tell more than a few strong ones
  Image<float> changes(grey.width(), grey.height());
  for (int v = border_px; v < grey.height() - border_px; ++v)
    for (int u = border_px; u < grey.width() - border_px; ++u)
      changes.at(u, v) = static_cast<float>(
          std::min(kMost, std::abs(grey.at(u + kReach_px, v) - grey.at(u - kReach_px, v)) +
                              std::abs(grey.at(u, v + kReach_px) - grey.at(u, v - kReach_px))));
  return changes;
}

EdgeAgreement edge_agreement(const RgbdFrame& frame) {
  constexpr int kBorder_px = 4;
  const DepthImage& depth_m = frame.depth_m;
  const int width = depth_m.width(), height = depth_m.height();
  const Image<float> changes = changes_of(frame.grey, kBorder_px);
  EdgeAgreement sum;
  for (int v = kBorder_px; v < height - kBorder_px; ++v) {
    for (int u = kBorder_px; u < width - kBorder_px; ++u) {
      const float d = depth_m.at(u, v);
      if (!is_step(d, depth_m.at(u + 1, v)) && !is_step(d, depth_m.at(u, v + 1))) continue;
      ++sum.edges;
      sum.as_is += changes.at(u, v);
      sum.upside_down += changes.at(u, height - 1 - v);
      sum.mirrored += changes.at(width - 1 - u, v);
      sum.turned += changes.at(width - 1 - u, height - 1 - v);
    }
  }
  const double usual = std::accumulate(changes.begin(), changes.end(), 0.0) /
                       static_cast<double>(changes.size()) * std::max(1, sum.edges);
  for (double* part : {&sum.as_is, &sum.upside_down, &sum.mirrored, &sum.turned})
    *part /= std::max(usual, 1e-9);
  return sum;
}

/// Depth that was turned over, or colour (by an EXIF tag, or a program). Over the recordings this
/// was tried on, edges of depth lie where colour changes 1.4 to 3.4 times as much as elsewhere;
/// turned over they do so 0.7 to 1.8 times, and always less than as they are.
void warn_about_place(const RgbdFrame& frame) {
  constexpr double kClear = 1.35, kClearer = 1.3;
  constexpr int kFewestEdges = 300;
  const EdgeAgreement found = edge_agreement(frame);
  if (found.edges < kFewestEdges) return;
  const std::array<std::pair<double, const char*>, 3> others = {
      {{found.upside_down, "upside down"},
       {found.mirrored, "mirrored"},
       {found.turned, "turned by 180 degrees"}}};
  const auto& [best, how] = *std::max_element(others.begin(), others.end());
  if (best > kClear && best > kClearer * found.as_is)
    log::warn("the first frame's depth seems to lie {} on its colour image", how);
}

}  // namespace

void warn_about_depth(const RgbdFrame& frame) {
  std::vector<float> depths;
  for (const float d : frame.depth_m) {
    if (d > 0) depths.push_back(d);
  }
  const double valid =
      static_cast<double>(depths.size()) / static_cast<double>(frame.depth_m.size());
  if (depths.empty()) {
    log::warn("the first frame has no depth in range: is depth_scale right?");
    return;
  }
  const float median_m = quantile(depths, 0.5);
  const float near_m = quantile(depths, 0.01);
  const float far_m = quantile(depths, 0.99);
  const bool is_too_far =
      median_m > kFarthestMedian_m && (near_m > kFarthestNear_m || valid < kLeastOfLargeRoom);
  constexpr float kFlat = 1.01F;
  if (far_m < kFlat * near_m)
    log::warn("the first frame's depth is {:.2f} m everywhere: is it depth?", median_m);
  warn_about_place(frame);
  if (median_m < kNearestMedian_m || is_too_far || far_m < kNearestFar_m ||
      valid < kLeastValidShare) {
    log::warn(
        "the first frame's depth looks odd (median {:.2f} m, nearly all within {:.2f} m, {:.0f} % "
        "of the pixels in range): is depth_scale right?",
        median_m, far_m, 100 * valid);
  }
}

void warn_about_size(const Sequence& sequence) {
  // Where 320x240 pixels give an ATE of 40 mm, 160x120 give 146 mm.
  constexpr int kSmallest_px = 240 * 180;
  const CameraConfig& camera = sequence.camera;
  if (camera.width * camera.height < kSmallest_px)
    log::warn("images of {}x{} pixels hold few corners and place them badly: poses will be coarse",
              camera.width, camera.height);
}

void log_shutter(const Sequence& sequence) {
  const CameraConfig& camera = sequence.camera;
  if (!shutter_times(camera).is_global()) {
    log::info("shutter from {}: colour is read in {:.3g} ms, depth in {:.3g} ms, {:.3g} ms later",
              sequence.shutter_source, camera.colour_readout_ms, camera.depth_readout_ms,
              camera.depth_delay_ms);
  } else if (camera.suspected_colour_readout_ms != 0) {
    log::info(
        "shutter unknown, taken as global until the pictures show otherwise; it may be that of a "
        "{}",
        sequence.shutter_source);
  } else if (!camera.shutter_known) {
    log::info(
        "shutter unknown, taken as global: `camera NAME` or colour_readout_ms and "
        "depth_readout_ms in the camera file tell of another (docs/camera.md)");
  }
}

void log_registration(const Sequence& sequence) {
  if (!sequence.registration) return;
  const DepthRegistration& depth = *sequence.registration;
  log::info("depth is registered to colour: {}x{} pixels of a camera {:.1f} mm away, from {}",
            depth.depth_camera().width, depth.depth_camera().height, 1e3 * depth.baseline_m(),
            sequence.depth_camera_source);
}

}  // namespace ygslam
