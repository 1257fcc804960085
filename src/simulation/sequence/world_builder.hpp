// From a world's description to a scene that can be rendered.
#pragma once

#include <memory>

#include "simulation/render/scene.hpp"
#include "simulation/world/world_config.hpp"

namespace ygslam::sim {

struct BuildOptions {
  bool without_people = false;
  bool without_movers = false;  ///< things; what people carry or push goes with the people
  int texture_size = 512;       ///< edge of tiled bitmaps [texels]; smaller builds faster
  std::uint64_t seed = 1;
  int threads = 2;  ///< that paint textures
};

/// @return kInput if the world cannot be built (more than 255 movers).
[[nodiscard]] Result<std::shared_ptr<const Scene>> build_world(const WorldConfig& world,
                                                               const BuildOptions& options);

}  // namespace ygslam::sim
