// Where the camera that takes the depth images stands, if that is not the colour camera:
// calibration_depth.txt.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "io/depth_registration.hpp"

namespace ygslam {

inline constexpr const char* kDepthCalibration = "calibration_depth.txt";

/// The keys of calibration.txt but those of the shutter, and a line
/// `T_colour_depth tx ty tz qx qy qz qw`: metres and unit quaternion, from the depth camera's
/// optical frame (x right, y down, z ahead) to the colour camera's. Width, height and depth_scale
/// default to 0 = "as the first image", "as the colour camera's". Files of other programs
/// (camera_formats) are read, too, with that line or, in JSON, that key as a list of numbers; where
/// it is missing the camera is taken to stand where the colour camera does, with a warning. Of
/// BundleFusion's info.txt the depth camera is taken.
/// @param name for messages. @return kConfig naming file, line and key.
[[nodiscard]] Result<DepthCamera> parse_depth_calibration(const std::string& text,
                                                          const std::string& name);
[[nodiscard]] Result<DepthCamera> read_depth_calibration(const std::filesystem::path& path);

/// parse_depth_calibration() gives the same camera, to ten digits.
[[nodiscard]] std::string format_depth_calibration(const DepthCamera& depth);

/// Whether two cameras can stand so in one device, and a quaternion is one.
/// @return what is wrong, empty if nothing.
[[nodiscard]] std::string fault_of_placement(const Eigen::Quaterniond& q_colour_depth,
                                             const Vec3& t_colour_depth_m);

}  // namespace ygslam
