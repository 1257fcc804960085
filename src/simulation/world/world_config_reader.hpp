// From YAML nodes to a world's description. For the .cpp files of simulation/.
#pragma once

#include "simulation/world/world_config.hpp"
#include "simulation/world/yaml_reader.hpp"

namespace ygslam::sim {

/// @param source what to call the file in messages. Throws YamlFault or YAML::Exception.
[[nodiscard]] WorldConfig read_world(const YAML::Node& node, const std::string& source);

}  // namespace ygslam::sim
