// What is known by now of the pixels of a dense view.
#pragma once

#include <memory>
#include <vector>

#include "dense/known_object.hpp"
#include "volume/depth_view.hpp"

namespace ygslam {

/// Cells of space whose surface was removed since a view saw it; in ascending order.
using RemovedCells = std::shared_ptr<const std::vector<CellKey>>;

struct PixelState {
  /// Of each observation: its object, or kRemovedObject.
  std::vector<SceneObjectId> ids;
  std::vector<RemovedCells> removed_objects;  ///< where they stood: what masks left out there
  RemovedCells removed;  ///< of surfaces, whatever they were taken for; none: nothing was removed
  /// Cells that the view saw through and in which something stands by now; none: nothing appeared.
  std::shared_ptr<const std::vector<Eigen::Vector3i>> appeared;

  /// By content.
  bool operator==(const PixelState& other) const;
};

[[nodiscard]] bool is_same_but_for_removed(const PixelState& a, const PixelState& b);
/// But for `removed` and `appeared`.
[[nodiscard]] bool is_same_but_for_changes(const PixelState& a, const PixelState& b);
/// As if nothing had appeared, and nothing been removed but objects.
[[nodiscard]] PixelState without_changes(PixelState state);
/// What of it the space that a view observed depends on: not on the numbers of objects, but on
/// which of them were removed.
[[nodiscard]] PixelState space_state(PixelState state);

/// Gives the objects of a view, which are numbers of observations from 1, their numbers, and
/// excludes the pixels of what was removed.
/// @param margin_px around the masks of what was removed. @param cell_m of the removed cells.
void apply_state(const PixelState& state, const SE3& T_world_camera, int margin_px, double cell_m,
                 DepthView& view);

}  // namespace ygslam
