// Camera files of other programs: settings of ORB-SLAM and stella_vslam, ROS camera_info, Kalibr,
// EuRoC, VINS, COLMAP, a bare line or matrix, JSON of Open3D, RealSense and nerfstudio, info.txt of
// BundleFusion.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "geometry/camera.hpp"

namespace ygslam {

/// transforms.json lists all frames beside the camera.
inline constexpr std::size_t kLargestCameraFile_bytes = std::size_t{64} << 20;

struct ForeignCamera {
  CameraConfig camera;            ///< width, height 0 and depth_scale 0 where the file says nothing
  std::string taken_for;          ///< "settings of ORB-SLAM", ...
  bool says_depth_scale = false;  ///< else it is what such files usually go with
};

/// Recognised by content. Values are not judged but for being finite; see camera_faults().
/// @return nothing where it is none of these formats; kConfig, with `name`, where it is one that
/// lacks a value or has a lens model that is not read (fisheye).
[[nodiscard]] std::optional<Result<ForeignCamera>> parse_foreign_camera(std::string_view text,
                                                                        const std::string& name);

/// Whether a file has a camera's keys as Open3D, RealSense and nerfstudio write them.
[[nodiscard]] bool has_json_camera(const std::filesystem::path& path);

/// "FILE is taken for settings of ORB-SLAM, 1000 units of depth per metre"; empty where it is none
/// of these formats.
[[nodiscard]] std::string foreign_camera_note(const std::string& path, double depth_scale);

}  // namespace ygslam
