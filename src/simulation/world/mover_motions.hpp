// How things move: pure functions of time made from a mover's plan.
#pragma once

#include <vector>

#include "simulation/render/scene.hpp"
#include "simulation/world/world_config.hpp"

namespace ygslam::sim {

/// Moves from station to station with smooth start and stop.
[[nodiscard]] RigidMotion path_motion(std::vector<Waypoint> stations);
/// The same along straight lines, turning as a ball of that radius rolls without slipping.
[[nodiscard]] RigidMotion rolling_motion(std::vector<Waypoint> stations, double radius_m);
/// Turns about the vertical through the first station.
[[nodiscard]] RigidMotion hinge_motion(std::vector<Waypoint> stations);

/// Pose on the floor: yaw about z, then the place.
[[nodiscard]] SE3 placed(const Vec3& at, double yaw_deg);
/// 0 at 0, 1 at 1, first and second derivative zero at both ends.
[[nodiscard]] double ease(double x);

}  // namespace ygslam::sim
