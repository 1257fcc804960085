#include "io/depth_registration.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace ygslam {
namespace {

constexpr float kNowhere_px = -1e6F;
constexpr float kNearest_m = 0.05F;  // nearer to the colour camera nothing is drawn
/// Neighbours whose depths differ by less lie on one surface: no gap may open between them.
constexpr float kSameSurface = 0.03F;

bool are_one_surface(float a_m, float b_m) {
  return b_m > 0 && std::abs(a_m - b_m) < kSameSurface * a_m;
}

/// Pixels whose centres lie in [from, to).
struct Span {
  int begin, end;
};
Span centres_between(float from, float to, int size) {
  const auto low = static_cast<int>(std::ceil(std::clamp(from, 0.0F, static_cast<float>(size))));
  const auto high = static_cast<int>(std::ceil(std::clamp(to, 0.0F, static_cast<float>(size))));
  return {low, high};
}

}  // namespace

struct DepthRegistration::Row {
  std::vector<float> depth_m;
  std::vector<Eigen::Vector2f> corner_px;
};

DepthRegistration::DepthRegistration(const DepthCamera& depth, const CameraConfig& colour)
    : depth_(depth.camera), colour_(colour), t_(depth.T_colour_depth.t().cast<float>()) {
  const Camera camera(depth_);
  rays_.reserve(corner(0, depth_.height + 1));
  for (int v = 0; v <= depth_.height; ++v)
    for (int u = 0; u <= depth_.width; ++u) {
      const Vec2 ideal_px = camera.undistort({u - 0.5, v - 0.5});
      rays_.emplace_back(
          (depth.T_colour_depth.R() * camera.unproject(ideal_px, 1)).template cast<float>());
    }
}

Eigen::Vector2f DepthRegistration::project(int corner_u, int corner_v, float depth_m) const {
  const Eigen::Vector3f p = depth_m * rays_[corner(corner_u, corner_v)] + t_;
  if (!(p.z() > kNearest_m)) return {kNowhere_px, kNowhere_px};
  const Vec2 ideal_px = colour_.project(p.cast<double>());
  // Beyond the image a lens's polynomial may fold back into it.
  constexpr double kMargin_px = 2;
  const auto& [min_x, min_y, max_x, max_y] = colour_.ideal_bounds();
  if (ideal_px.x() < min_x - kMargin_px || ideal_px.y() < min_y - kMargin_px ||
      ideal_px.x() > max_x + kMargin_px || ideal_px.y() > max_y + kMargin_px)
    return {kNowhere_px, kNowhere_px};
  return colour_.distort(ideal_px).cast<float>();
}

void DepthRegistration::place_row(const DepthImage& depth_m, int v, Row& row) const {
  row.depth_m.assign(depth_m.row(v), depth_m.row(v) + depth_m.width());
  row.corner_px.resize(row.depth_m.size());
  for (int u = 0; u < depth_m.width(); ++u)
    if (row.depth_m[u] > 0) row.corner_px[u] = project(u, v, row.depth_m[u]);
}

void DepthRegistration::draw_row(const Row& row, const Row& below, int v, DepthImage& out) const {
  for (int u = 0; u < depth_.width; ++u) {
    const float z_m = row.depth_m[u];
    if (!(z_m > 0)) continue;
    const Eigen::Vector2f from_px = row.corner_px[u];
    const Eigen::Vector2f end_px = project(u + 1, v + 1, z_m);
    if (from_px.x() == kNowhere_px || end_px.x() == kNowhere_px) continue;
    Eigen::Vector2f low_px = from_px.cwiseMin(end_px), high_px = from_px.cwiseMax(end_px);
    // A slanted surface: the neighbour's piece moves otherwise, and the gap between is this one's.
    const auto reach = [&](const Row& next, int next_u, int axis) {
      if (next_u >= depth_.width || !are_one_surface(z_m, next.depth_m[next_u])) return;
      const Eigen::Vector2f next_px = next.corner_px[next_u];
      if (next_px.x() != kNowhere_px) high_px[axis] = std::max(high_px[axis], next_px[axis]);
    };
    reach(row, u + 1, 0);
    if (!below.depth_m.empty()) reach(below, u, 1);
    const float depth_m =
        z_m * 0.5F * (rays_[corner(u, v)].z() + rays_[corner(u + 1, v + 1)].z()) + t_.z();
    const Span across = centres_between(low_px.x(), high_px.x(), out.width());
    const Span down = centres_between(low_px.y(), high_px.y(), out.height());
    for (int y = down.begin; y < down.end; ++y)
      for (int x = across.begin; x < across.end; ++x) {
        float& there_m = out.at(x, y);
        if (there_m == 0 || depth_m < there_m) there_m = depth_m;
      }
  }
}

DepthImage DepthRegistration::registered(const DepthImage& depth_m) const {
  CHECK(depth_m.width() == depth_.width && depth_m.height() == depth_.height);
  DepthImage out(colour_.width(), colour_.height());
  Row row, below;
  place_row(depth_m, 0, row);
  for (int v = 0; v < depth_.height; ++v) {
    if (v + 1 < depth_.height) {
      place_row(depth_m, v + 1, below);
    } else {
      below.depth_m.clear();
    }
    draw_row(row, below, v, out);
    std::swap(row, below);
  }
  return out;
}

std::shared_ptr<const DepthRegistration> depth_registration(const DepthCamera& depth,
                                                            const CameraConfig& colour) {
  const CameraConfig& d = depth.camera;
  const auto lens = [](const CameraConfig& c) {
    return std::array{c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3};
  };
  const bool is_same = lens(d) == lens(colour) && d.width == colour.width &&
                       d.height == colour.height &&
                       depth.T_colour_depth.R().isApprox(Mat3::Identity(), 1e-12) &&
                       depth.T_colour_depth.t().norm() < 1e-9;
  if (is_same) return nullptr;
  return std::make_shared<const DepthRegistration>(depth, colour);
}

}  // namespace ygslam
