// Where a sequence's camera comes from: calibration.txt, or a preset known by the folder's name.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "geometry/camera.hpp"

namespace ygslam {

/// A number of a camera by its key in camera files.
struct CameraKey {
  std::string_view name;
  double CameraConfig::*value;
  bool required = false;
};
/// All but width and height, which are whole numbers.
[[nodiscard]] std::span<const CameraKey> camera_keys();
/// Whether a key says when rows are read.
[[nodiscard]] bool is_shutter_key(std::string_view key);

/// What is wrong with one value of a camera.
struct CameraFault {
  std::string key;     ///< as in calibration.txt: fx, k1, depth_scale, ...
  std::string reason;  ///< "must be ..., is ..."
};
/// A camera file's `camera NAME`: the device's shutter where the file says nothing else of it.
/// @param name of camera_devices(); empty = none. @param camera times that are not known are NaN:
/// the device's, or 0. With shutter_known false all are.
/// @return a fault where there is no such device, or it takes its images otherwise than the file
/// says.
[[nodiscard]] std::optional<CameraFault> apply_device(std::string_view name, CameraConfig& camera);

/// ICL-NUIM writes its camera, whose y points up, with fy < 0. Its images are those of a camera
/// with y down and -fy, which it becomes (not with distortion); its truth is a mirrored one.
void turn_y_down(CameraConfig& camera, const std::string& name);

/// Every value that no real camera has: not finite, focal length or depth scale not positive or
/// absurd, principal point outside the image, distortion that cannot be undone over the whole
/// image, size out of range.
/// Values that depend on the image size are judged only where width and height are given (> 0).
[[nodiscard]] std::vector<CameraFault> camera_faults(const CameraConfig& camera);

/// A camera of another program's file with the depth scale where it says none, if it is one.
struct ForeignCamera;
[[nodiscard]] Result<CameraConfig> judged_foreign_camera(const Result<ForeignCamera>& foreign,
                                                         double depth_scale,
                                                         const std::string& name);

/// A file of another program (camera_formats), or lines `key value`, comments with #, and `camera
/// NAME` for a device's shutter. Needs fx fy cx cy; k1 k2 p1 p2 k3 default to 0, depth_scale to
/// 5000, the shutter's times to 0, width and height to 0 = "as the first image".
/// @param name for messages. @param folder that an image named by `ignore` counts from, see
/// io/ignored_pixels.hpp. @return kConfig naming file, line and key; an unknown key names the
/// nearest known one.
[[nodiscard]] Result<CameraConfig> parse_calibration(std::string_view text, const std::string& name,
                                                     const std::filesystem::path& folder = {});
[[nodiscard]] Result<CameraConfig> read_calibration(const std::filesystem::path& path);

/// The text of a calibration.txt; parse_calibration() gives the same camera, to ten digits. Of a
/// depth_scale of 0 (as the colour camera's) nothing is said.
[[nodiscard]] std::string format_calibration(const CameraConfig& camera);

/// The line on which a key stands in a calibration file's text; 0 if nowhere.
[[nodiscard]] int calibration_line(std::string_view text, std::string_view key);

struct CameraPreset {
  std::string name;
  CameraConfig camera;
};
/// TUM freiburg1, freiburg2, freiburg3 and Bonn (rgbd_bonn_*), recognised in the folder's name.
[[nodiscard]] std::optional<CameraPreset> camera_preset(std::string_view folder_name);

}  // namespace ygslam
