#include "dense/pixel_state.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace ygslam {
namespace {

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

void exclude_places(const PixelState& state, const SE3& T_world_camera, double cell_m,
                    DepthView& view) {
  std::vector<EmptiedCells> places;
  for (const EmptiedPlace& emptied : state.emptied) places.emplace_back(*emptied, cell_m, false);
  if (state.gone) places.emplace_back(*state.gone, cell_m, true);
  const Pinhole& camera = view.camera;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
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
