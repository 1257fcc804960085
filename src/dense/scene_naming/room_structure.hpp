// What a room is built of, from its mesh alone: which way is up, floor, ceiling and walls, as no
// network names them; and what its cells are of.
#pragma once

#include <vector>

#include "scene/scene.hpp"

namespace ygslam {

struct RoomStructureConfig {
  double max_tilt_rad = 0.6;        ///< of true up from the guess
  double min_floor_m2 = 0.3;        ///< of surface at one height
  double plane_m = 0.06;            ///< so near a plane its surface lies
  double min_wall_m2 = 1.0;         ///< in one plane
  double min_wall_height_m = 0.8;   ///< that is seen
  double min_room_height_m = 1.8;   ///< a ceiling is so high above the floor
  double min_below_camera_m = 0.3;  ///< a floor is so far below the cameras
};

/// Of each vertex: a third of the area of each triangle around it [m2].
[[nodiscard]] std::vector<double> vertex_areas_m2(const TriangleMesh& mesh);

/// Up is where most level surfaces face; the floor is the lowest large one below the camera.
/// @param up_guess_world e.g. against the y axis of a camera held upright, roughly.
[[nodiscard]] Gravity find_gravity(const TriangleMesh& mesh, const Vec3& up_guess_world,
                                   const Vec3& camera_world,
                                   const RoomStructureConfig& config = {});

/// Names floor, ceiling and walls where no object is. The less a vertex lies in the plane, or faces
/// as it does, the less probable.
void label_structure(TriangleMesh& mesh, const Gravity& gravity,
                     const RoomStructureConfig& config = {});

/// An occupied cell is what the surest vertex of a known class in it is.
void label_cells(const TriangleMesh& mesh, SpaceCells& space);

}  // namespace ygslam
