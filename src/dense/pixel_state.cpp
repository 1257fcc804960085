#include "dense/pixel_state.hpp"

#include <algorithm>

namespace ygslam {
namespace {

void exclude_places(const PixelState& state, const SE3& T_world_camera, double cell_m,
                    DepthView& view) {
  const Pinhole& camera = view.camera;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      std::uint8_t& object = view.object.at(u, v);
      const double depth_m = view.depth.at(u, v) * DepthView::kUnit_m;
      if (object == DepthView::kExcluded || depth_m <= 0) continue;
      const Vec3 p_camera((u - camera.cx) / camera.fx * depth_m,
                          (v - camera.cy) / camera.fy * depth_m, depth_m);
      const CellKey key = cell_key(T_world_camera * p_camera, cell_m);
      const auto holds = [key](const EmptiedPlace& place) {
        return std::binary_search(place->begin(), place->end(), key);
      };
      const bool is_emptied = !DepthView::is_thing(object) &&
                              std::any_of(state.emptied.begin(), state.emptied.end(), holds);
      if (is_emptied || (state.gone && holds(state.gone))) object = DepthView::kExcluded;
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
