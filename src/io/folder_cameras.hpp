// The cameras of folders without lists, as the data sets write them.
#pragma once

#include "core/result.hpp"
#include "io/sequence.hpp"

namespace ygslam {

/// As given; else of calibration.txt; else of cam_params.json (Replica), info.txt (BundleFusion),
/// intrinsic/ (ScanNet), camera_intrinsic.json (Open3D) or transforms.json (nerfstudio), which must
/// agree; else the preset of the folder's name, or 7-Scenes' known one.
/// @return kConfig: none of these, a damaged one, or two that differ.
[[nodiscard]] Result<CameraConfig> find_folder_camera(const GivenCameras& given,
                                                      Sequence& sequence);

/// The depth camera of such a folder, where it is another; to be called when the sequence is
/// complete. @return as set_depth_camera().
Status find_folder_depth_camera(const GivenCameras& given, Sequence& sequence);

}  // namespace ygslam
