// The camera file of --camera: YAML with the keys of calibration.txt.
#pragma once

#include <filesystem>
#include <string>

#include "core/result.hpp"
#include "geometry/camera.hpp"

namespace ygslam {

/// The keys of calibration.txt, with the same defaults; see parse_calibration().
/// @param depth_scale where the file gives none [units per metre].
/// @param name for messages. @param folder as of parse_calibration(). @return kConfig naming file
/// and key, and the line where it is known.
[[nodiscard]] Result<CameraConfig> parse_camera_yaml(const std::string& text,
                                                     const std::string& name,
                                                     double depth_scale = 5000,
                                                     const std::filesystem::path& folder = {});
[[nodiscard]] Result<CameraConfig> read_camera_yaml(const std::string& path,
                                                    double depth_scale = 5000);

}  // namespace ygslam
