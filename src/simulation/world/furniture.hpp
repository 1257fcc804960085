// Furniture and small things, each in its own frame: origin on the floor (or on the surface it
// stands on), front towards -y.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "simulation/surface/materials.hpp"

namespace ygslam::sim {

/// @param kind one of furniture_kinds(). @param variant picks size details, colours and pictures.
/// @param size_m if given, the outer size (width x, depth y, height z) of things that come in any
/// size. @return nullopt if the kind is unknown.
[[nodiscard]] std::optional<Mesh> make_furniture(const std::string& kind, int variant,
                                                 const std::optional<Vec3f>& size_m,
                                                 MaterialLibrary& materials);
[[nodiscard]] const std::vector<std::string>& furniture_kinds();

}  // namespace ygslam::sim
