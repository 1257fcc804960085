// `ygslam simulate --random`: single frames for training a network.
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "simulation/random/random_frames.hpp"

namespace ygslam {

/// Writes frames as folder/WORLD/SHOT.jpg, SHOT_depth.png (16 bits, 5000 units a metre) and
/// SHOT_people.png (0 = nobody), and a line for each in frames.csv as soon as its images are there.
/// @return kOutput if the folder cannot be written.
[[nodiscard]] Status write_random_frames(const std::filesystem::path& folder, int count,
                                         const sim::RandomFramesOptions& options);

}  // namespace ygslam
