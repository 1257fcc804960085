// The static scene as plain values: what the dense map hands out and what files, pictures and
// scores are made of. All of it lies in the world frame [m].
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/time.hpp"
#include "geometry/se3.hpp"
#include "image/image.hpp"
#include "scene/semantic_class.hpp"

namespace ygslam {

/// What a point of a surface is, and how sure that is.
struct SurfaceLabel {
  SemanticClass semantic_class = SemanticClass::kUnknown;
  SceneObjectId object = kNoSceneObject;
  float probability = 0;  ///< of the class, 0 to 1
};

struct SurfacePoint {
  Eigen::Vector3f p_world = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal_world = Eigen::Vector3f::Zero();  ///< unit length, out of the surface
  Rgb8 colour;
  SurfaceLabel label;
};

/// Vertices are shared by the triangles around them; seen from outside a triangle's corners turn
/// counter-clockwise.
struct TriangleMesh {
  std::vector<SurfacePoint> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

enum class SpaceState : std::uint8_t { kUnknown, kFree, kOccupied };

/// A cube of observed space; what is in no cell is unknown.
struct SpaceCell {
  Eigen::Vector3i index = Eigen::Vector3i::Zero();  ///< covers [index, index + 1) * cell_m
  SpaceState state = SpaceState::kUnknown;
  float log_odds = 0;  ///< of being occupied, as OctoMap has it
  Rgb8 colour;         ///< of the surface in an occupied cell
  SurfaceLabel label;
};

/// Cells in ascending order of (z, y, x), each index once.
struct SpaceCells {
  double cell_m = 0.05;
  std::vector<SpaceCell> cells;
};
/// Whether the point lies in a cell that was seen to be air.
[[nodiscard]] bool is_free(const SpaceCells& space, const Vec3& p_world);

enum class ObjectState : std::uint8_t {
  kCandidate,  ///< seen too seldom to be sure
  kStatic,     ///< stands where it always stood
  kMoving,
  kSettled,     ///< was moved and stands again
  kAbsent,      ///< its place was seen empty
  kUnobserved,  ///< its place is hidden or out of sight
};

/// A box that stands upright: its z axis is the scene's up.
struct OrientedBox {
  SE3 T_world_box;             ///< origin in the middle of the box
  Vec3 size_m = Vec3::Zero();  ///< along the box's axes
};

/// Where a thing stood that stands elsewhere now.
struct EarlierPlace {
  OrientedBox box;
  Timestamp first_seen, last_seen;
  Timestamp found_empty;  ///< when it was sure that it is not there any more
};

/// A thing that stands in the room.
struct SceneObject {
  SceneObjectId id = kNoSceneObject;
  SemanticClass semantic_class = SemanticClass::kUnknown;
  float probability = 0;  ///< of the class
  ObjectState state = ObjectState::kCandidate;
  OrientedBox box;
  int views = 0;   ///< keyframes that showed it
  int epochs = 1;  ///< places it has stood at
  Timestamp first_seen, last_seen;
  std::vector<EarlierPlace> earlier;     ///< one less than epochs
  std::optional<Timestamp> known;        ///< no candidate at this place since
  std::optional<Timestamp> found_empty;  ///< absent since
};

/// Which way is up, and the floor's height; unknown where no floor was seen.
struct Gravity {
  Vec3 up_world = Vec3(0, 0, 1);
  double floor_m = 0;      ///< of the floor along up_world
  bool has_floor = false;  ///< one was seen; else floor_m is the height of the lowest level surface
};

/// All that is known of it.
struct StaticScene {
  TriangleMesh mesh;
  SpaceCells space;
  std::vector<SceneObject> objects;
  Gravity gravity;
};

}  // namespace ygslam
