// Folders of images as people have them: in TUM layout, or colour and depth images whose names say
// what belongs together.
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "io/sequence.hpp"

namespace ygslam {

/// A folder in TUM layout where it has lists; else one of these: `results/frame*` and
/// `results/depth*` (Replica), `color` and `depth` (ScanNet as exported), or any two folders such
/// as `rgb` and `depth` whose images have equal names or numbers. Names with a point are stamps in
/// seconds, numbers count frames at 30 Hz.
/// @return as open_tum_sequence().
[[nodiscard]] Result<Sequence> open_folder_sequence(const std::filesystem::path& root,
                                                    const GivenCameras& cameras = {});

/// Whether a folder holds images as open_folder_sequence() finds them without lists.
[[nodiscard]] bool has_image_folders(const std::filesystem::path& root);

}  // namespace ygslam
