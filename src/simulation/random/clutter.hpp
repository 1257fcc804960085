// What lies about on tables, counters and floors: small things of any shape, for random rooms.
#pragma once

#include "core/rng.hpp"
#include "simulation/surface/materials.hpp"

namespace ygslam::sim {

[[nodiscard]] MaterialId random_material(MaterialLibrary& materials, Rng& rng);

/// Things that lie and stand on a rectangle of this size [m] around the origin, z up.
[[nodiscard]] Mesh random_clutter(const Vec2& size_m, MaterialLibrary& materials, Rng& rng);

}  // namespace ygslam::sim
