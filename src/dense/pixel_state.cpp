#include "dense/pixel_state.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace ygslam {
namespace {

constexpr double kInFront_m = 0.05;  // nearer which a box is taken to fill the image

/// Cells and the box around them, which tells of most points that they lie in none.
struct EmptiedCells {
  const std::vector<CellKey>* cells;
  Eigen::AlignedBox3d box_world;
  bool of_things;  // whatever its surface was taken for

  EmptiedCells(const std::vector<CellKey>& keys, double cell_m, bool of_things_too)
      : cells(&keys), of_things(of_things_too) {
    for (const CellKey key : keys) {
      const Vec3 low = low_corner(key, cell_m);
      box_world.extend(low);
      box_world.extend(low + Vec3::Constant(cell_m));
    }
  }
  [[nodiscard]] bool contains(const Vec3& p_world, double cell_m) const {
    return box_world.contains(p_world) &&
           std::binary_search(cells->begin(), cells->end(), cell_key(p_world, cell_m));
  }
};

/// Pixels from the first to before the last.
struct Window {
  int u0 = 0, u1 = 0, v0 = 0, v1 = 0;

  void add(const Window& other) {
    if (other.u0 >= other.u1 || other.v0 >= other.v1) return;
    const bool is_empty = u0 == u1;
    u0 = is_empty ? other.u0 : std::min(u0, other.u0);
    v0 = is_empty ? other.v0 : std::min(v0, other.v0);
    u1 = std::max(u1, other.u1);
    v1 = std::max(v1, other.v1);
  }
};

/// Outside it nothing of the box is seen.
Window window_of(const Eigen::AlignedBox3d& box_world, const SE3& T_camera_world,
                 const Pinhole& camera) {
  if (box_world.isEmpty()) return {};
  Eigen::AlignedBox2d box_px;
  for (int i = 0; i < 8; ++i) {
    const Vec3 p =
        T_camera_world * box_world.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
    if (p.z() < kInFront_m) return {0, camera.width, 0, camera.height};
    box_px.extend(
        Vec2(camera.fx * p.x() / p.z() + camera.cx, camera.fy * p.y() / p.z() + camera.cy));
  }
  const auto pixel = [](double at_px, int size_px) {
    return static_cast<int>(std::clamp(std::floor(at_px), 0.0, static_cast<double>(size_px)));
  };
  return {pixel(box_px.min().x() - 1, camera.width), pixel(box_px.max().x() + 2, camera.width),
          pixel(box_px.min().y() - 1, camera.height), pixel(box_px.max().y() + 2, camera.height)};
}

void exclude_places(const PixelState& state, const SE3& T_world_camera, double cell_m,
                    DepthView& view) {
  std::vector<EmptiedCells> places;
  for (const EmptiedPlace& emptied : state.emptied) places.emplace_back(*emptied, cell_m, false);
  if (state.gone) places.emplace_back(*state.gone, cell_m, true);
  const Pinhole& camera = view.camera;
  const SE3 T_camera_world = T_world_camera.inverse();
  Window window;
  for (const EmptiedCells& place : places)
    window.add(window_of(place.box_world, T_camera_world, camera));
  for (int v = window.v0; v < window.v1; ++v) {
    for (int u = window.u0; u < window.u1; ++u) {
      std::uint8_t& object = view.object.at(u, v);
      const double depth_m = view.depth.at(u, v) * DepthView::kUnit_m;
      if (object == DepthView::kExcluded || depth_m <= 0) continue;
      const Vec3 p_camera((u - camera.cx) / camera.fx * depth_m,
                          (v - camera.cy) / camera.fy * depth_m, depth_m);
      const Vec3 p_world = T_world_camera * p_camera;
      const bool is_thing = DepthView::is_thing(object);
      if (std::any_of(places.begin(), places.end(), [&](const EmptiedCells& place) {
            return (place.of_things || !is_thing) && place.contains(p_world, cell_m);
          }))
        object = DepthView::kExcluded;
    }
  }
}

}  // namespace

bool PixelState::operator==(const PixelState& other) const {
  const auto same = [](const auto& a, const auto& b) { return a == b || (a && b && *a == *b); };
  return ids == other.ids && same(gone, other.gone) && same(came, other.came) &&
         std::equal(emptied.begin(), emptied.end(), other.emptied.begin(), other.emptied.end(),
                    same);
}

PixelState without_changes(PixelState state) {
  state.gone = nullptr;
  state.came = nullptr;
  return state;
}

PixelState seen_state(PixelState state) {
  for (SceneObjectId& id : state.ids)
    if (id != kWithdrawnObject) id = kNoSceneObject;
  return without_changes(std::move(state));
}

void apply_state(const PixelState& state, const SE3& T_world_camera, int margin_px, double cell_m,
                 DepthView& view) {
  std::vector<bool> is_gone;
  for (SceneObjectId& object : view.objects) {
    object = state.ids[static_cast<std::size_t>(object) - 1];
    is_gone.push_back(object == kWithdrawnObject);
  }
  exclude_objects(view, is_gone, margin_px);
  if (state.came) view.spared = *state.came;
  if (!state.emptied.empty() || state.gone) exclude_places(state, T_world_camera, cell_m, view);
}

}  // namespace ygslam
