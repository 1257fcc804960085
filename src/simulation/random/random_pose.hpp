// Postures drawn at random, for single frames that a network is trained on.
#pragma once

#include "core/rng.hpp"
#include "simulation/people/pose.hpp"

namespace ygslam::sim {

enum class Posture { kStand, kWalk, kSit, kKneel, kSquat, kBend, kLie };

/// What people in rooms do, standing and sitting most.
[[nodiscard]] Posture random_posture(Rng& rng);

/// @param T_world_floor body frame: on the floor (or what else carries the person), x forward.
/// @param seat_m height of the seat, for those who sit.
[[nodiscard]] BodyPose random_pose(const BodyModel& model, const BodyShape& shape, Posture posture,
                                   const SE3& T_world_floor, double seat_m, Rng& rng);

}  // namespace ygslam::sim
