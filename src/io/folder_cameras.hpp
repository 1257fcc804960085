// The cameras of folders without lists, as the data sets write them.
#pragma once

#include "core/result.hpp"
#include "io/sequence.hpp"

namespace ygslam {

/// As given; else of calibration.txt or a preset (camera_of_folder()), cam_params.json (Replica),
/// intrinsic/ (ScanNet), info.txt (BundleFusion), or 7-Scenes' known one.
/// @return kConfig: none of these, or a damaged one.
[[nodiscard]] Result<CameraConfig> find_folder_camera(const GivenCameras& given,
                                                      Sequence& sequence);

/// The depth camera of such a folder, where it is another; to be called when the sequence is
/// complete. @return as set_depth_camera().
Status find_folder_depth_camera(const GivenCameras& given, Sequence& sequence);

}  // namespace ygslam
