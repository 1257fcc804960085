// The true poses of a recording that has them in a folder of its own, one 4x4 matrix a file.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "core/result.hpp"
#include "io/trajectory_formats.hpp"

namespace ygslam {

/// A pose from the camera to the world, as 16 numbers row by row, or 12 without the last row.
/// @return nothing where the numbers are not finite (the camera was lost); kInput with a reason
/// alone where it is no rigid motion.
[[nodiscard]] Result<std::optional<SE3>> parse_pose_file(std::string_view text);

/// What a folder has of true poses: groundtruth.txt; itself where it has `*.pose.txt`, `poses` or
/// `pose` with one pose a file, or `traj.txt` beside `results` (Replica).
[[nodiscard]] std::optional<std::filesystem::path> truth_of_folder(
    const std::filesystem::path& root);

/// The poses of such a folder, or of one that has nothing but files of poses, with the stamps that
/// their names have as names of images would. What it was taken for is logged.
/// @return kInput naming folder or file: no poses, no rigid motion, names that are not clear.
[[nodiscard]] Result<TrajectoryFile> read_truth_folder(const std::filesystem::path& root);

}  // namespace ygslam
