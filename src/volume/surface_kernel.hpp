// The innermost loop of the surface layer: one view, one block.
#pragma once

#include "volume/surface_layer.hpp"

namespace ygslam {

/// At a grazing view the band about a pixel's plane reaches far along the ray, to where the surface
/// has long bent away: so many widths of the band are believed.
inline constexpr float kLongestReach = 1.5F;

/// A view at a pose, ready for projecting voxels. Points are in the camera frame, x and y
/// multiplied by the focal lengths.
struct SurfaceProjection {
  const PreparedView* view;
  SE3 T_camera_world;
  Eigen::Vector3f step_x, step_y, step_z;  ///< from one voxel to the next along the world's axes
  float centre_u, centre_v;                ///< principal point and half a pixel [px]
  NoiseModel noise;
  float truncation_m, truncation_sigmas;
  float per_quantum;  ///< quanta per metre
  double voxel_m;

  SurfaceProjection(const PreparedView& prepared, const SE3& T_world_camera,
                    const SurfaceConfig& config, const DepthNoise& depth_noise, double quantum_m);
  /// The centre of the block's first voxel.
  [[nodiscard]] Eigen::Vector3f origin(BlockKey key) const;
};

/// Adds (sign 1) or subtracts (sign -1) the view's contribution to a block.
/// @param pool where bricks come from and go back to. @return whether there was any.
bool fuse_block(const SurfaceProjection& projection, BlockKey key, int sign, BrickPool& pool,
                SurfaceBlock& block);

/// The same, voxel by voxel: what processors without AVX2 use; equal bits.
bool fuse_block_plain(const SurfaceProjection& projection, BlockKey key, int sign, BrickPool& pool,
                      SurfaceBlock& block);

}  // namespace ygslam
