#include "dense/place_look.hpp"

#include <cmath>

namespace ygslam {
namespace {

constexpr double kNearM = 0.2;
constexpr int kBesidePx = 2;        // masks and depth are not exact to the pixel
constexpr double kSomeShare = 0.2;  // of the surface: enough to say something of this one look

enum class Sight { kHidden, kThere, kThrough };

Sight sight_of(const Vec3& p_camera, const DepthView& view, double margin_m) {
  const Pinhole& camera = view.camera;
  const int u = static_cast<int>(std::lround(camera.fx * p_camera.x() / p_camera.z() + camera.cx));
  const int v = static_cast<int>(std::lround(camera.fy * p_camera.y() / p_camera.z() + camera.cy));
  constexpr int kSteps[5][2] = {
      {0, 0}, {kBesidePx, 0}, {-kBesidePx, 0}, {0, kBesidePx}, {0, -kBesidePx}};
  int beyond = 0;
  for (const auto& [du, dv] : kSteps) {
    if (!view.depth.contains(u + du, v + dv)) return Sight::kHidden;
    const double depth_m = view.depth.at(u + du, v + dv) * DepthView::kUnit_m;
    if (depth_m <= 0) continue;
    if (std::abs(depth_m - p_camera.z()) <= margin_m) return Sight::kThere;
    if (depth_m < p_camera.z()) return Sight::kHidden;
    ++beyond;
  }
  return beyond > 2 ? Sight::kThrough : Sight::kHidden;
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

}  // namespace

bool look_at_place(const DepthView& view, const SE3& T_world_camera, Timestamp stamp,
                   const PlaceLookConfig& config, KnownObject& object) {
  const SE3 T_camera_world = T_world_camera.inverse();
  const NoiseModel noise(config.noise);
  Shares now, lately;
  for (auto& [key, grain] : object.grains) {
    if (!object.believes(grain.views)) continue;
    ++now.all;
    ++lately.all;
    const Vec3 p_camera = T_camera_world * grain.mean_world();
    if (p_camera.z() > kNearM) {
      const double margin_m =
          config.margin_m + config.margin_sigmas * static_cast<double>(noise.sigma_m(
                                                       static_cast<float>(p_camera.z())));
      const Sight sight = sight_of(p_camera, view, margin_m);
      if (sight != Sight::kHidden) {
        now.add(sight == Sight::kThrough);
        if (!grain.looked_at || *grain.looked_at <= stamp) {
          grain.looked_at = stamp;
          grain.seen_through = sight == Sight::kThrough;
        }
      }
    }
    const bool is_recent =
        grain.looked_at && std::abs(seconds_between(stamp, *grain.looked_at)) <= config.window_s;
    if (is_recent) lately.add(grain.seen_through);
  }
  object.is_leaving = now.sees(config.min_visible) && now.is_empty(config.min_through);
  if (now.sees(kSomeShare)) {
    const bool is_empty = now.is_empty(config.min_through);
    object.empty_looks = is_empty ? object.empty_looks + 1 : 0;
    if (!is_empty) object.shown.insert(stamp);
  }
  if (object.empty_looks < config.min_looks || !lately.sees(config.min_visible) ||
      !lately.is_empty(config.min_through))
    return false;
  object.found_empty = stamp;
  return true;
}

}  // namespace ygslam
