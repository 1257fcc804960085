#include "dense/background/frame_geometry.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

constexpr float kNearest_m = 0.05F;
constexpr int kRounds = 3;  // as RollingShutter::seen_at

}  // namespace

FrameGeometry::FrameGeometry(const Camera& camera, const SE3& T_world_camera,
                             const ReadOut& read_out)
    : camera_(camera), T_world_camera_(T_world_camera) {
  const RollingShutter shutter(camera.height(), read_out);
  const int rows = shutter.is_rolling() ? camera.height() : 1;
  for (int v = 0; v < rows; ++v) {
    const double t_s = shutter.is_rolling() ? shutter.colour_time_s(v) : 0;
    const SE3 T_world_row = T_world_camera * SE3::exp(t_s * read_out.body_velocity);
    rows_.push_back({T_world_row.R().cast<float>(), T_world_row.t().cast<float>()});
  }
}

const FrameGeometry::RowPose& FrameGeometry::row(float v) const {
  if (rows_.size() == 1) return rows_.front();
  const float last = static_cast<float>(rows_.size() - 1);
  return rows_[static_cast<std::size_t>(std::lround(std::clamp(v, 0.0F, last)))];
}

Eigen::Vector2f FrameGeometry::pixel(const Eigen::Vector3f& p_camera) const {
  const Vec2 ideal_px = camera_.project(p_camera.cast<double>());
  if (!camera_.config().is_distorted()) return ideal_px.cast<float>();
  return camera_.distort(ideal_px).cast<float>();
}

std::optional<FrameGeometry::Seen> FrameGeometry::project(const Eigen::Vector3f& p_world) const {
  const bool rolling = rows_.size() > 1;
  Eigen::Vector3f p_camera = in_camera(rows_[rows_.size() / 2], p_world);
  if (!(p_camera.z() > kNearest_m)) return std::nullopt;
  Eigen::Vector2f uv_px = pixel(p_camera);
  for (int round = 0; rolling && round < kRounds; ++round) {
    p_camera = in_camera(row(uv_px.y()), p_world);
    if (!(p_camera.z() > kNearest_m)) return std::nullopt;
    uv_px = pixel(p_camera);
  }
  return Seen{uv_px, p_camera.z()};
}

Eigen::Vector3f FrameGeometry::unproject(int u, int v, float z_m) const {
  const Vec2 ideal_px = camera_.config().is_distorted() ? camera_.undistort({u, v}) : Vec2(u, v);
  const RowPose& pose = row(static_cast<float>(v));
  return pose.R_world_camera * camera_.unproject(ideal_px, z_m).cast<float>() + pose.t_world_camera;
}

}  // namespace ygslam
