// What is known of cameras one can buy: when their rows are read. Sources in docs/camera.md.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "geometry/camera.hpp"

namespace ygslam {

/// When an image's rows are read.
struct ImageShutter {
  enum class Kind { kGlobal, kRolling, kRollingUnknown };
  Kind kind = Kind::kGlobal;
  double readout_ms = 0;  ///< of all rows, where kind is kRolling
};

struct CameraDevice {
  std::string_view name;  ///< as in `camera kinect_v1`
  std::string_view title;
  ImageShutter colour;
  ImageShutter depth;       ///< of the rows of the depth image registered to colour
  bool is_measured = true;  ///< false: the times are those of a relative, where an estimate starts

  [[nodiscard]] bool is_known() const {
    return colour.kind != ImageShutter::Kind::kRollingUnknown &&
           depth.kind != ImageShutter::Kind::kRollingUnknown;
  }
};

[[nodiscard]] std::span<const CameraDevice> camera_devices();
[[nodiscard]] const CameraDevice* find_camera_device(std::string_view name);

/// Sets the times of the device; shutter_known where all are known and were measured on one.
void set_shutter(const CameraDevice& device, CameraConfig& camera);
/// Sets its suspected times: it may be this device, or any other.
void suspect(const CameraDevice& device, CameraConfig& camera);

struct RecognisedDevice {
  const CameraDevice* device = nullptr;  ///< nullptr: none
  bool is_certain = false;               ///< false: another may have the same numbers
  std::string_view by;                   ///< what it was recognised by, for the log
  double depth_delay_ms = 0;             ///< of these recordings' stamps; see CameraConfig
};
/// The device that made a recording of TUM or Bonn is certain by the folder's name and similar
/// intrinsics, or by distorted intrinsics of theirs: nobody else's agree to a hundredth of a pixel.
/// The numbers every Kinect, Xtion and Carmine comes with (525 px) are a suspicion.
[[nodiscard]] RecognisedDevice recognised_device(std::string_view folder_name,
                                                 const CameraConfig& camera);

}  // namespace ygslam
