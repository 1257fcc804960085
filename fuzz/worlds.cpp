#include <cmath>

#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "simulation/world/world_config.hpp"

namespace ygslam::fuzz {

void worlds(std::string_view bytes) {
  const auto world = sim::parse_world(std::string(bytes), "world.yaml");
  if (world.ok()) CHECK(std::isfinite(world->seconds) && std::isfinite(world->fps));
}

}  // namespace ygslam::fuzz
