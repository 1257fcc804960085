// The innermost loop of SpaceScan: one view, one block.
#pragma once

#include "volume/space_scan.hpp"

namespace ygslam {

/// A view at a pose, ready for projecting cells. Points are in the camera frame, x and y
/// multiplied by the focal lengths in tiles of the depth pyramid.
struct SpaceProjection {
  const PreparedView* view;
  SE3 T_camera_world;
  Eigen::Vector3f step_x, step_y, step_z;  ///< from one cell to the next along the world's axes
  float centre_tile_u, centre_tile_v;      ///< principal point [tiles of the depth pyramid]
  float half_size_tile_m;  ///< half a cell times the focal length: over z, its half size [tiles]
  float half_depth_m;      ///< half of a cell's extent along the optical axis
  NoiseModel noise;
  float margin_m, margin_sigmas;
  double cell_m;

  SpaceProjection(const PreparedView& prepared, const SE3& T_world_camera,
                  const SpaceConfig& config, const DepthNoise& depth_noise);
  /// The first cell's centre.
  [[nodiscard]] Eigen::Vector3f origin(BlockKey key) const;
};

/// The cells of a block that the view saw through: every depth in the square that the cell covers
/// lies behind it, and there is one.
[[nodiscard]] CellMask cells_seen_through(const SpaceProjection& projection, BlockKey key);
/// The same, cell by cell: what processors without AVX2 use; equal bits.
[[nodiscard]] CellMask cells_seen_through_plain(const SpaceProjection& projection, BlockKey key);

}  // namespace ygslam
