// What is known of an object that stands somewhere: counts over the keyframes that showed it.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>
#include <vector>

#include "core/time.hpp"
#include "dense/object_observation.hpp"
#include "geometry/se3.hpp"

namespace ygslam {

/// A cube of the world, by the whole numbers of its place.
using CellKey = std::uint64_t;
inline constexpr int kCellAxisBits = 21;
[[nodiscard]] CellKey cell_key(const Vec3& p_world, double cell_m);
/// Of the cell's place, counted from the least that there is.
[[nodiscard]] inline Eigen::Vector3i cell_coordinates(CellKey key) {
  constexpr CellKey kMask = (CellKey{1} << kCellAxisBits) - 1;
  return {static_cast<int>(key >> 2 * kCellAxisBits & kMask),
          static_cast<int>(key >> kCellAxisBits & kMask), static_cast<int>(key & kMask)};
}
/// Of the cell, in the world [m].
[[nodiscard]] Vec3 low_corner(CellKey key, double cell_m);
/// The 26 cells around another, and itself: what is added to its key.
[[nodiscard]] const std::vector<CellKey>& neighbour_steps();

/// A small part of its surface.
struct SurfacePatch {
  Vec3 sum_world = Vec3::Zero();  ///< of the points in it [m]
  int points = 0;
  int views = 0;     ///< that showed it in a mask of the object
  int in_sight = 0;  ///< views that showed it, and the object in a mask
  /// The last view in which it was not hidden, and whether that saw through it.
  std::optional<Timestamp> observed_at;
  bool seen_through = false;

  [[nodiscard]] Vec3 mean_world() const { return sum_world / points; }
};

/// In place of the number of an object that is not there any more.
inline constexpr SceneObjectId kRemovedObject{0xffff};

/// At one place: where it stands next it is another KnownObject.
struct KnownObject {
  std::map<SemanticClass, double> class_scores;  ///< sums over its views
  std::unordered_map<CellKey, int> cells;        ///< how many views showed its surface there
  std::map<CellKey, SurfacePatch> patches;       ///< finer
  Eigen::AlignedBox3d extent_world;              ///< of all its cells
  std::set<Timestamp> seen;                      ///< of the keyframes that showed it
  std::set<Timestamp> shown;  ///< the same, and those that saw its surface without a mask of it
  ColourCounts colours{};
  Vec3 viewed_along_world = Vec3::Zero();  ///< sum of the directions it was seen in, of unit length
  int empty_observations = 0;              ///< in a row that saw through its place
  bool is_leaving = false;          ///< the keyframe that is being looked at sees through its place
  std::optional<Timestamp> moving;  ///< when it was last seen to move,
  Vec3 moving_world = Vec3::Zero();      ///< and where
  std::optional<Timestamp> found_empty;  ///< since then it is absent

  [[nodiscard]] int views() const { return static_cast<int>(seen.size()); }
  [[nodiscard]] SemanticClass best_class() const;
  /// Mean score of the best class over the views that saw its surface: one without a mask of it
  /// counts as 0, and what the scores left open is unknown.
  [[nodiscard]] float probability() const;
  /// Of a cell: what a single view showed is not believed once there are many.
  [[nodiscard]] bool believes(int views_of_it) const;
  /// Of a patch: masks reach over edges now and then, each view in another place.
  [[nodiscard]] bool believes(const SurfacePatch& patch) const;
  /// Points of its surface, in a fixed order.
  [[nodiscard]] std::vector<Vec3> surface_world() const;
  /// Its cells, in ascending order.
  [[nodiscard]] std::vector<CellKey> place() const;
  /// Takes up all that is known of another that is the same.
  void merge(const KnownObject& other);
};

/// How two objects look that may be the same at different places.
struct Likeness {
  double size = 0;    ///< ratio of the smaller to the larger, 0 to 1
  double colour = 0;  ///< shared part of their colours, 0 to 1
};
[[nodiscard]] Likeness likeness(const KnownObject& a, const KnownObject& b);

}  // namespace ygslam
