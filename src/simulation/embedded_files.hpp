// Files built into the library: the named worlds, their layouts and the baked bodies.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ygslam::sim {

/// @param name path below the project's configs/worlds/ or assets/, e.g. "static_xyz.yaml".
[[nodiscard]] std::optional<std::string_view> embedded_file(const std::string& name);
[[nodiscard]] std::vector<std::string> embedded_file_names();

}  // namespace ygslam::sim
