#include "geometry/rolling_shutter.hpp"

namespace ygslam {
namespace {

constexpr double kMs = 1e-3;
constexpr int kRounds = 3;  // each shrinks the error by the skew per row, at most a twentieth

}  // namespace

ShutterTimes shutter_times(const CameraConfig& camera) {
  return {kMs * camera.colour_readout_ms, kMs * camera.depth_readout_ms,
          kMs * camera.depth_delay_ms};
}

RollingShutter::RollingShutter(int image_height, const ReadOut& read_out)
    : velocity_(read_out.body_velocity),
      middle_px_(image_height / 2.0),
      colour_row_s_(read_out.times.colour_readout_s / image_height),
      depth_row_s_(read_out.times.depth_readout_s / image_height),
      depth_delay_s_(read_out.times.depth_delay_s),
      rolling_(!read_out.times.is_global() && !velocity_.isZero(0)),
      depth_has_own_time_(rolling_ && (depth_row_s_ != colour_row_s_ || depth_delay_s_ != 0)) {}

Vec2 RollingShutter::seen_at(const Camera& camera, const Vec3& p_middle) const {
  Vec2 uv_px = camera.distort(camera.project(p_middle));
  if (!rolling_) return uv_px;
  for (int round = 0; round < kRounds; ++round) {
    const Vec3 p_cam = earlier(p_middle, -colour_time_s(uv_px.y()));
    if (p_cam.z() <= 0) break;
    uv_px = camera.distort(camera.project(p_cam));
  }
  return uv_px;
}

}  // namespace ygslam
