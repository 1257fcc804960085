#include "app/recording_check.hpp"

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
