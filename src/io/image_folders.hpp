// Folders of images as people have them: in TUM layout, or colour and depth images whose names say
// what belongs together.
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "io/sequence.hpp"

namespace ygslam {

/// A folder in TUM layout where it has lists; else one of these: `results/frame*` and
/// `results/depth*` (Replica), `frame-*.color.*` and `frame-*.depth.*` (7-Scenes, BundleFusion),
/// `color` and `depth` (ScanNet as exported), or any two folders such as `rgb` and `depth`. What
/// the digits of their names say is told by times_of_names(), and by `notes` of the sequence.
/// @return as open_tum_sequence(); kInput, too, where the times in the names are not clear, and
/// where nothing of this is there: what is, and whether the folder above or below is meant.
[[nodiscard]] Result<Sequence> open_folder_sequence(const std::filesystem::path& root,
                                                    const GivenCameras& cameras = {});

/// Whether a folder holds images as open_folder_sequence() finds them without lists.
[[nodiscard]] bool has_image_folders(const std::filesystem::path& root);

}  // namespace ygslam
