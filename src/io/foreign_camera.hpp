// What the readers of other programs' camera files share.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "io/camera_formats.hpp"

namespace ygslam::foreign_camera {

inline constexpr double kMillimetres = 1000;
/// Nothing where a file is none of the format.
using Foreign = std::optional<Result<ForeignCamera>>;

[[nodiscard]] Error fault(const std::string& name, const std::string& what);
/// Without a size and a depth scale.
[[nodiscard]] ForeignCamera blank(const std::string& taken_for);
/// @return false where it is no size of an image.
[[nodiscard]] bool set_side(double value, int& side_px);
void set_lens(CameraConfig& camera, double fx, double fy, double cx, double cy);
/// k1 k2 p1 p2 [k3], as OpenCV and ROS order them.
void set_distortion(CameraConfig& camera, const std::vector<double>& values);

struct FlatYaml {
  std::map<std::string, std::string, std::less<>> values;
  std::set<std::string, std::less<>> contradicted;  ///< keys that stand there with two values

  /// Empty where the key is not there.
  [[nodiscard]] std::string value(std::string_view key) const;
  [[nodiscard]] bool is_not_0(std::string_view key) const;
  /// Of `[1, 2]`. @return nothing where the key is not there or one is no number.
  [[nodiscard]] std::optional<std::vector<double>> numbers(std::string_view key) const;
};
/// `Key: value` lines of a YAML file; those below `Group:` are called Group.Key.
[[nodiscard]] FlatYaml flat_yaml(std::string_view text);

/// The numbers of a list behind a key and, where it has one, its `data`: in brackets, or one a line
/// behind dashes. Empty where the key stands there more than once, with other numbers.
[[nodiscard]] std::optional<std::vector<double>> numbers_behind(std::string_view text,
                                                                std::string_view key);

/// Settings of ORB-SLAM2, ORB-SLAM3 and stella_vslam: `Camera.fx`, or `Camera1.fx`.
[[nodiscard]] Foreign parse_orb_settings(std::string_view text, const std::string& name);
/// ROS camera_info as calibrators write it, or as `topic echo` shows it; OpenCV's calibrations.
[[nodiscard]] Foreign parse_camera_info(std::string_view text, const std::string& name);
/// Kalibr's camchain, EuRoC's sensor.yaml: `intrinsics: [fu, fv, cu, cv]`.
[[nodiscard]] Foreign parse_kalibr(std::string_view text, const std::string& name);
/// VINS-Mono and VINS-Fusion: `projection_parameters`.
[[nodiscard]] Foreign parse_vins(std::string_view text, const std::string& name);

/// NICE-SLAM, SplaTAM and others: `fx` and `png_depth_scale` below `cam:` or `camera_params:`.
[[nodiscard]] Foreign parse_neural(std::string_view text, const std::string& name);

}  // namespace ygslam::foreign_camera
