// What is known by now of the pixels of a dense keyframe.
#pragma once

#include <memory>
#include <vector>

#include "dense/known_object.hpp"
#include "volume/depth_view.hpp"

namespace ygslam {

/// Cells from which something went that the keyframe still showed; in ascending order.
using EmptiedPlace = std::shared_ptr<const std::vector<CellKey>>;

struct PixelState {
  /// Of each detection: its object, or kWithdrawnObject.
  std::vector<SceneObjectId> ids;
  std::vector<EmptiedPlace> emptied;
  EmptiedPlace gone;  ///< the same of surfaces, whatever they were taken for; none: nothing went
  /// Cells through which it looked and in which something stands by now; none: nothing came.
  std::shared_ptr<const std::vector<Eigen::Vector3i>> came;

  /// By content.
  bool operator==(const PixelState& other) const;
};

/// As if nothing had come or gone but things.
[[nodiscard]] PixelState without_changes(PixelState state);
/// What of it the view's space depends on: numbers of things do not matter, but what went does.
[[nodiscard]] PixelState seen_state(PixelState state);

/// Gives the objects of a view, which are numbers of detections from 1, their numbers, and excludes
/// the pixels of what went.
/// @param margin_px around the masks of what went. @param cell_m of the emptied places.
void apply_state(const PixelState& state, const SE3& T_world_camera, int margin_px, double cell_m,
                 DepthView& view);

}  // namespace ygslam
