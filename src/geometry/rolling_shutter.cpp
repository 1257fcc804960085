#include "geometry/rolling_shutter.hpp"

namespace ygslam {
namespace {

constexpr double kMs = 1e-3;
constexpr int kRounds = 3;  // each shrinks the error by the skew per row, at most a twentieth

}  // namespace

RollingShutter::RollingShutter(const CameraConfig& camera, const Vec6& body_velocity)
    : velocity_(body_velocity),
      middle_px_(camera.height / 2.0),
      colour_row_s_(kMs * camera.colour_readout_ms / camera.height),
      depth_row_s_(kMs * camera.depth_readout_ms / camera.height),
      depth_delay_s_(kMs * camera.depth_delay_ms),
      rolling_(ygslam::is_rolling(camera) && !body_velocity.isZero(0)),
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
