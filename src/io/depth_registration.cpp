#include "io/depth_registration.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace ygslam {
namespace {

constexpr float kNowhere_px = -1e6F;
constexpr float kNearest_m = 0.05F;  // nearer to the colour camera nothing is drawn
/// Neighbours whose depths differ by less, as a share, lie on one surface: no gap may open between
/// them. A surface 60 degrees from upright changes by 1.1 % a pixel at a focal length of 150 px.
constexpr float kSameSurfaceShare = 0.03F;

bool are_one_surface(float a_m, float b_m) {
  return b_m > 0 && std::abs(a_m - b_m) < kSameSurfaceShare * a_m;
}

bool is_nowhere(const Eigen::Vector2f& px) { return px.x() == kNowhere_px; }

/// Cosine of a rotation about the line of sight by which boxes of opposite corners stay good.
constexpr double kUpright = 0.95;

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
    : depth_(depth.camera),
      colour_(colour),
      t_colour_depth_m_(depth.T_colour_depth.t().cast<float>()),
      focal_px_(Vec2(colour.fx, colour.fy).cast<float>()),
      centre_px_(Vec2(colour.cx, colour.cy).cast<float>()),
      is_distorted_(colour.is_distorted()),
      is_upright_(depth.T_colour_depth.R()(0, 0) > kUpright &&
                  depth.T_colour_depth.R()(1, 1) > kUpright) {
  // So far beyond the image pieces may still reach into it.
  const double margin_px =
      2 + 2 * std::max(colour.fx / depth.camera.fx, colour.fy / depth.camera.fy);
  const auto& [min_x, min_y, max_x, max_y] = colour_.ideal_bounds();
  low_px_ = Vec2(min_x - margin_px, min_y - margin_px).cast<float>();
  high_px_ = Vec2(max_x + margin_px, max_y + margin_px).cast<float>();
  const Camera camera(depth_);
  rays_colour_.reserve(corner(0, depth_.height + 1));
  for (int v = 0; v <= depth_.height; ++v)
    for (int u = 0; u <= depth_.width; ++u) {
      const Vec2 ideal_px = camera.undistort({u - 0.5, v - 0.5});
      rays_colour_.emplace_back(
          (depth.T_colour_depth.R() * camera.unproject(ideal_px, 1)).template cast<float>());
    }
}

Eigen::Vector2f DepthRegistration::project(int corner_u, int corner_v, float depth_m) const {
  const Eigen::Vector3f p = depth_m * rays_colour_[corner(corner_u, corner_v)] + t_colour_depth_m_;
  if (!(p.z() > kNearest_m)) return {kNowhere_px, kNowhere_px};
  const Eigen::Vector2f px(focal_px_.x() * p.x() / p.z() + centre_px_.x(),
                           focal_px_.y() * p.y() / p.z() + centre_px_.y());
  // Not drawn; and a lens's polynomial may fold back into the image what lies beyond it.
  if ((px.array() < low_px_.array()).any() || (px.array() > high_px_.array()).any())
    return {kNowhere_px, kNowhere_px};
  return is_distorted_ ? colour_.distort(px.cast<double>()).cast<float>() : px;
}

void DepthRegistration::place_row(const DepthImage& depth_m, int v, Row& row) const {
  row.depth_m.assign(depth_m.row(v), depth_m.row(v) + depth_m.width());
  row.corner_px.resize(row.depth_m.size());
  for (int u = 0; u < depth_m.width(); ++u)
    if (row.depth_m[u] > 0) row.corner_px[u] = project(u, v, row.depth_m[u]);
}

std::optional<DepthRegistration::Box> DepthRegistration::box_of(const Row& row, const Row& below,
                                                                int u, int v) const {
  const float z_m = row.depth_m[u];
  const Eigen::Vector2f corner_px = row.corner_px[u], far_px = project(u + 1, v + 1, z_m);
  if (is_nowhere(corner_px) || is_nowhere(far_px)) return std::nullopt;
  Box box{corner_px.cwiseMin(far_px), corner_px.cwiseMax(far_px)};
  const auto cover = [&box](const Eigen::Vector2f& px) {
    if (is_nowhere(px)) return;
    box.low_px = box.low_px.cwiseMin(px);
    box.high_px = box.high_px.cwiseMax(px);
  };
  if (!is_upright_) {
    cover(project(u + 1, v, z_m));
    cover(project(u, v + 1, z_m));
  }
  // A slanted surface: the neighbour's piece moves otherwise, and the gap between is this one's.
  const auto reach = [&](const Row& next, int next_u) {
    if (!are_one_surface(z_m, next.depth_m[next_u])) return;
    cover(next.corner_px[next_u]);
    if (!is_upright_) cover(project(u + 1, v + 1, next.depth_m[next_u]));
  };
  if (u + 1 < depth_.width) reach(row, u + 1);
  if (!below.depth_m.empty()) reach(below, u);
  return box;
}

void DepthRegistration::draw_row(const Row& row, const Row& below, int v, DepthImage& out) const {
  for (int u = 0; u < depth_.width; ++u) {
    if (!(row.depth_m[u] > 0)) continue;
    const auto box = box_of(row, below, u, v);
    if (!box) continue;
    const float ray_z =
        0.5F * (rays_colour_[corner(u, v)].z() + rays_colour_[corner(u + 1, v + 1)].z());
    const float depth_m = row.depth_m[u] * ray_z + t_colour_depth_m_.z();
    const Span across = centres_between(box->low_px.x(), box->high_px.x(), out.width());
    const Span down = centres_between(box->low_px.y(), box->high_px.y(), out.height());
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
