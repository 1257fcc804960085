// What the makers of furniture share. For the furniture*.cpp files.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "core/rng.hpp"
#include "simulation/surface/materials.hpp"

namespace ygslam::sim {

/// What every maker gets.
struct Order {
  int variant;
  std::optional<Vec3f> size_m;
  MaterialLibrary& materials;
  [[nodiscard]] Vec3f size_or(float x, float y, float z) const {
    return size_m.value_or(Vec3f(x, y, z));
  }
  [[nodiscard]] Rng rng() const { return Rng(static_cast<std::uint64_t>(variant) * 977U + 5U); }
};

/// A box that stands with its middle at (x, y) on height z.
inline void box_at(Mesh& mesh, float x, float y, float z, float sx, float sy, float sz,
                   MaterialId m) {
  add_box(mesh, {x - sx / 2, y - sy / 2, z}, {x + sx / 2, y + sy / 2, z + sz}, m);
}

using Maker = Mesh (*)(const Order&);
using MakerTable = std::map<std::string, Maker>;
[[nodiscard]] const MakerTable& small_things();  ///< what lies on desks or stands in corners

}  // namespace ygslam::sim
