#include "geometry/rolling_shutter.hpp"

namespace ygslam {
namespace {

constexpr double kMs = 1e-3;
constexpr double kSeriesAngle2 = 0.3 * 0.3;  // to there three terms are exact to 1e-10
constexpr int kRounds = 3;  // each shrinks the error by the skew per row, at most a twentieth

}  // namespace

ShutterTimes shutter_times(const CameraConfig& camera) {
  return {kMs * camera.colour_readout_ms, kMs * camera.depth_readout_ms,
          kMs * camera.depth_delay_ms};
}

RollingShutter::RollingShutter(int image_height, const ReadOut& read_out)
    : velocity_(read_out.body_velocity),
      rotation_of_v_(velocity_.tail<3>().cross(velocity_.head<3>())),
      rotated_twice_v_(velocity_.tail<3>().cross(rotation_of_v_)),
      middle_px_(image_height / 2.0),
      colour_row_s_(read_out.times.colour_readout_s / image_height),
      depth_row_s_(read_out.times.depth_readout_s / image_height),
      depth_delay_s_(read_out.times.depth_delay_s),
      rolling_(!read_out.times.is_global() && !velocity_.isZero(0)),
      depth_has_own_time_(rolling_ && (depth_row_s_ != colour_row_s_ || depth_delay_s_ != 0)) {}

// exp() written out, its sines and cosines as series: it is wanted for each feature of a frame.
Vec3 RollingShutter::earlier(const Vec3& p_cam, double dt_s) const {
  const Vec3 w = velocity_.tail<3>();
  const double angle2 = dt_s * dt_s * w.squaredNorm();
  if (angle2 > kSeriesAngle2) return SE3::exp(dt_s * velocity_) * p_cam;
  const double a = 1 - angle2 / 6 * (1 - angle2 / 20 * (1 - angle2 / 42));
  const double b = (1 - angle2 / 12 * (1 - angle2 / 30 * (1 - angle2 / 56))) / 2;
  const double c = (1 - angle2 / 20 * (1 - angle2 / 42 * (1 - angle2 / 72))) / 6;
  const Vec3 wp = w.cross(p_cam);
  return p_cam + dt_s * (velocity_.head<3>() + a * wp +
                         dt_s * (b * (w.cross(wp) + rotation_of_v_) + dt_s * c * rotated_twice_v_));
}

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
