// A recorded RGB-D sequence in TUM layout.
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "io/sequence.hpp"

namespace ygslam {

/// Reads the lists and the camera of a folder; no image is decoded yet, only headers are looked at
/// until one is readable.
/// @param cameras replace calibration.txt, presets and calibration_depth.txt; width or height <= 0:
/// as the first image.
/// @return kInput: no folder, no list, nothing usable in it, less than 10 % of the colour images
/// have a depth image, no image header readable. kConfig: no camera known, or one with impossible
/// values (file, line and key are named).
[[nodiscard]] Result<Sequence> open_tum_sequence(const std::filesystem::path& root,
                                                 const GivenCameras& cameras = {});

}  // namespace ygslam
