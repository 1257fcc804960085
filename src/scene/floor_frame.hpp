// Where the floor lies: the frame of ground plans and of the yaw of boxes.
#pragma once

#include "scene/scene.hpp"

namespace ygslam {

/// Pose of the floor's frame: z is up, x the horizontal part of the world's x axis (of its y axis
/// where x stands upright), the origin the floor's point above or below the world's origin.
[[nodiscard]] SE3 T_world_floor(const Gravity& gravity);

/// Angle about the floor's z axis that turns its x axis into the box's, in (-pi, pi] [rad].
[[nodiscard]] double box_yaw(const OrientedBox& box, const Gravity& gravity);

}  // namespace ygslam
