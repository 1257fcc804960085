#include "dense/place_check.hpp"

#include <cmath>

namespace ygslam {
namespace {

constexpr double kNear_m = 0.2;
constexpr int kBeside_px = 2;       // masks and depth are not exact to the pixel
constexpr double kSomeShare = 0.2;  // of the surface: enough to say something of this one look

enum class Visibility { kHidden, kThere, kThrough };

Visibility visibility_of(const Vec3& p_camera, const DepthView& view, double margin_m) {
  const Pinhole& camera = view.camera;
  const int u = static_cast<int>(std::lround(camera.fx * p_camera.x() / p_camera.z() + camera.cx));
  const int v = static_cast<int>(std::lround(camera.fy * p_camera.y() / p_camera.z() + camera.cy));
  constexpr int kSteps[5][2] = {
      {0, 0}, {kBeside_px, 0}, {-kBeside_px, 0}, {0, kBeside_px}, {0, -kBeside_px}};
  int beyond = 0;
  for (const auto& [du, dv] : kSteps) {
    if (!view.depth.contains(u + du, v + dv)) return Visibility::kHidden;
    const double depth_m = view.depth.at(u + du, v + dv) * DepthView::kUnit_m;
    if (depth_m <= 0) continue;
    if (std::abs(depth_m - p_camera.z()) <= margin_m) return Visibility::kThere;
    if (depth_m < p_camera.z()) return Visibility::kHidden;
    ++beyond;
  }
  return beyond > 2 ? Visibility::kThrough : Visibility::kHidden;
}

struct Shares {
  int all = 0, visible = 0, through = 0;
  void add(bool is_through) {
    ++visible;
    through += is_through ? 1 : 0;
  }
  [[nodiscard]] bool sees(double share) const { return visible > 0 && visible >= share * all; }
  [[nodiscard]] bool is_empty(double share) const { return through >= share * visible; }
};

/// What a view says of points of one object's surface.
class Look {
 public:
  Look(const DepthView& view, const SE3& T_world_camera, const PlaceCheckConfig& config)
      : view_(view),
        T_camera_world_(T_world_camera.inverse()),
        noise_(config.noise),
        config_(config) {}

  [[nodiscard]] Visibility at(const Vec3& p_world) const {
    const Vec3 p_camera = T_camera_world_ * p_world;
    if (p_camera.z() <= kNear_m) return Visibility::kHidden;
    const double sigma_m = static_cast<double>(noise_.sigma_m(static_cast<float>(p_camera.z())));
    return visibility_of(p_camera, view_, config_.margin_m + config_.margin_sigmas * sigma_m);
  }

  /// Whether all of a box lies on the outer side of one of the image's edges, or behind.
  [[nodiscard]] bool is_outside(const Eigen::AlignedBox3d& box_world) const {
    const Pinhole& camera = view_.camera;
    unsigned outside = 0xff;  // a bit for each side
    for (int i = 0; i < 8; ++i) {
      const Vec3 p =
          T_camera_world_ * box_world.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
      const double x = camera.fx * p.x(), y = camera.fy * p.y();
      outside &= (p.z() <= kNear_m ? 1U : 0U) | (x < (-1 - camera.cx) * p.z() ? 2U : 0U) |
                 (x > (camera.width - camera.cx) * p.z() ? 4U : 0U) |
                 (y < (-1 - camera.cy) * p.z() ? 8U : 0U) |
                 (y > (camera.height - camera.cy) * p.z() ? 16U : 0U);
    }
    return outside != 0;
  }

 private:
  const DepthView& view_;
  SE3 T_camera_world_;
  NoiseModel noise_;
  const PlaceCheckConfig& config_;
};

}  // namespace

bool check_place(const DepthView& view, const SE3& T_world_camera, Timestamp stamp,
                 const PlaceCheckConfig& config, KnownObject& object) {
  const Look look(view, T_world_camera, config);
  object.is_leaving = false;
  if (look.is_outside(object.extent_world)) return false;
  Shares now, lately;
  for (auto& [key, patch] : object.patches) {
    const Visibility visibility = look.at(patch.mean_world());
    if (visibility != Visibility::kHidden && (!patch.observed_at || *patch.observed_at <= stamp)) {
      patch.observed_at = stamp;
      patch.seen_through = visibility == Visibility::kThrough;
    }
    if (!object.believes(patch)) continue;
    ++now.all;
    ++lately.all;
    if (visibility != Visibility::kHidden) now.add(visibility == Visibility::kThrough);
    const bool is_recent = patch.observed_at &&
                           std::abs(seconds_between(stamp, *patch.observed_at)) <= config.window_s;
    if (is_recent) lately.add(patch.seen_through);
  }
  object.is_leaving = now.sees(config.min_visible) && now.is_empty(config.min_through);
  if (now.sees(kSomeShare)) {
    const bool is_empty = now.is_empty(config.min_through);
    object.empty_observations = is_empty ? object.empty_observations + 1 : 0;
    if (!is_empty) object.shown.insert(stamp);
  }
  if (object.empty_observations < config.min_observations || !lately.sees(config.min_visible) ||
      !lately.is_empty(config.min_through))
    return false;
  object.found_empty = stamp;
  return true;
}

bool sees_through(const DepthView& view, const SE3& T_world_camera, const PlaceCheckConfig& config,
                  const KnownObject& object) {
  const Look look(view, T_world_camera, config);
  if (look.is_outside(object.extent_world)) return false;
  Shares now;
  for (const auto& [key, patch] : object.patches) {
    if (!object.believes(patch)) continue;
    ++now.all;
    if (const Visibility visibility = look.at(patch.mean_world());
        visibility != Visibility::kHidden)
      now.add(visibility == Visibility::kThrough);
  }
  const double visible =
      object.empty_observations < config.min_observations ? kSomeShare : config.min_visible;
  return now.sees(visible) && now.is_empty(config.min_through);
}

}  // namespace ygslam
