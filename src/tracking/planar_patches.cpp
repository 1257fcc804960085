#include "tracking/planar_patches.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace ygslam {
namespace {

constexpr int kPatchColumns = 40;          // of the grid
constexpr int kLeastPatchCells = 12;       // a hundredth of the grid
constexpr double kOffPlane_per_m = 0.006;  // three times the noise of inverse depth
constexpr std::array<std::array<int, 2>, 4> kBeside{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

/// Least squares of inverse depth over rays.
struct PlaneSums {
  Mat3 H = Mat3::Zero();
  Vec3 b = Vec3::Zero();
  void add(const Vec2& ray, double inverse_depth) {
    const Vec3 x = ray.homogeneous();
    H.noalias() += x * x.transpose();
    b += inverse_depth * x;
  }
  [[nodiscard]] Vec3 plane() const { return H.ldlt().solve(b); }
};

}  // namespace

PlanarPatches::PlanarPatches(const Camera& camera, const DepthImage& depth_m)
    : step_px_(std::max(1, depth_m.width() / kPatchColumns)),
      columns_(depth_m.width() / step_px_),
      rows_(depth_m.height() / step_px_),
      cells_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {
  for (int v = 0; v < rows_; ++v) {
    for (int u = 0; u < columns_; ++u) {
      const int at_u = u * step_px_ + step_px_ / 2;
      const int at_v = v * step_px_ + step_px_ / 2;
      const float d = depth_m.at(at_u, at_v);
      const Vec3 ray = camera.unproject(camera.undistort(Vec2(at_u, at_v)), 1);
      at(u, v) = {ray.head<2>(), d > 0 ? 1.0 / d : 0.0, -1};
    }
  }
  for (int v = 1; v + 1 < rows_; ++v)
    for (int u = 1; u + 1 < columns_; ++u)
      if (is_seed(u, v)) grow_from(u, v);
}

/// Flat as far as its neighbours.
bool PlanarPatches::is_seed(int u, int v) const {
  const Cell& cell = at(u, v);
  if (cell.patch >= 0 || cell.inverse_depth <= 0) return false;
  for (const auto& [du, dv] : {std::array{1, 0}, std::array{0, 1}}) {
    const double before = at(u - du, v - dv).inverse_depth;
    const double after = at(u + du, v + dv).inverse_depth;
    if (before <= 0 || after <= 0 ||
        std::abs(before + after - 2 * cell.inverse_depth) > 2 * kOffPlane_per_m)
      return false;
  }
  return true;
}

void PlanarPatches::grow_from(int u, int v) {
  PlaneSums sums;
  for (int dv = -1; dv <= 1; ++dv)
    for (int du = -1; du <= 1; ++du)
      if (const Cell& c = at(u + du, v + dv); c.inverse_depth > 0) sums.add(c.ray, c.inverse_depth);
  Vec3 plane = sums.plane();
  const int id = static_cast<int>(planes_.size());
  std::vector<std::array<int, 2>> members{{u, v}};
  at(u, v).patch = id;
  sums = {};
  std::size_t refit_at = 9;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const auto [from_u, from_v] = members[i];
    sums.add(at(from_u, from_v).ray, at(from_u, from_v).inverse_depth);
    if (i + 1 == refit_at) {
      plane = sums.plane();
      refit_at *= 2;
    }
    for (const auto& [du, dv] : kBeside) {
      if (!contains(from_u + du, from_v + dv)) continue;
      Cell& next = at(from_u + du, from_v + dv);
      if (next.patch >= 0 || next.inverse_depth <= 0) continue;
      if (std::abs(plane.dot(next.ray.homogeneous()) - next.inverse_depth) > kOffPlane_per_m)
        continue;
      next.patch = id;
      members.push_back({from_u + du, from_v + dv});
    }
  }
  if (std::ssize(members) >= kLeastPatchCells) {
    planes_.push_back(sums.plane());
    return;
  }
  for (const auto& [at_u, at_v] : members) at(at_u, at_v).patch = -1;
}

int PlanarPatches::patch_at(const Eigen::Vector2f& uv_px, const Vec3& p_camera) const {
  const int u = static_cast<int>(uv_px.x()) / step_px_;
  const int v = static_cast<int>(uv_px.y()) / step_px_;
  const Vec3 ray = p_camera / p_camera.z();
  for (int dv = -1; dv <= 1; ++dv) {
    for (int du = -1; du <= 1; ++du) {
      if (!contains(u + du, v + dv)) continue;
      const int patch = at(u + du, v + dv).patch;
      if (patch < 0) continue;
      const double off_per_m = planes_[static_cast<std::size_t>(patch)].dot(ray) - 1 / p_camera.z();
      if (std::abs(off_per_m) < kOffPlane_per_m) return patch;
    }
  }
  return -1;
}

}  // namespace ygslam
