// Which blocks of the surface layer a pixel may contribute to.
#pragma once

#include "volume/surface_layer.hpp"

namespace ygslam {

struct ReachConfig {
  const SE3& T_world_camera;
  const SurfaceConfig& surface;
  const DepthNoise& noise;
};

/// Of two views of one camera at one pose, adds every block that a pixel in which they differ
/// contributes to, and a few more.
void add_reached(const PreparedView& old, const PreparedView& now, const ReachConfig& config,
                 BlockSet& reached);

}  // namespace ygslam
