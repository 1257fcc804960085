// What a robot's wheels tell, as text: odom.csv (docs/inertial.md).
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "geometry/imu.hpp"
#include "io/trajectory.hpp"

namespace ygslam {

/// Poses of the base in any of the formats of trajectories with stamps.
/// @return kInput naming the file: what read_trajectory() refuses, no stamps, a folder, and what
/// wheels_of_poses() refuses.
[[nodiscard]] Result<std::vector<OdometrySample>> read_wheels(const std::filesystem::path& path);

/// @param poses in order of time. @return kInput with a reason alone: poses that are seldom, or
/// that follow each other faster than any robot (millimetres, degrees, stamps of another unit).
[[nodiscard]] Result<std::vector<OdometrySample>> wheels_of_poses(
    std::span<const StampedPose> poses);

}  // namespace ygslam
