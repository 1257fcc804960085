// The true surface beside a rendered sequence.
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "eval/surface_score.hpp"

namespace ygslam {

/// Of a folder that `ygslam simulate --truth` wrote: static.ply, what of it at least three of every
/// fifth frame show within 4 m (depth_true where it is depth_static), and where movers hid it
/// (depth_true is nearer); both one point for each cube of 2 cm. Of a PLY file: its surface, all of
/// it seen, movers unknown. Frame of the ground truth.
/// @return kInput naming the file.
[[nodiscard]] Result<SurfaceTruth> read_surface_truth(const std::filesystem::path& path);

/// @return kInput naming the file; also where it holds no point.
[[nodiscard]] Result<Surface> read_surface(const std::filesystem::path& file);

/// @return kInput, naming the file, where a surface is larger than what can be judged.
[[nodiscard]] Status check_area(const Surface& surface, const std::filesystem::path& file);

}  // namespace ygslam
