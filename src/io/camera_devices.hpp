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
  ImageShutter depth;  ///< of the rows of the depth image registered to colour

  [[nodiscard]] bool is_known() const {
    return colour.kind != ImageShutter::Kind::kRollingUnknown &&
           depth.kind != ImageShutter::Kind::kRollingUnknown;
  }
};

[[nodiscard]] std::span<const CameraDevice> camera_devices();
[[nodiscard]] const CameraDevice* find_camera_device(std::string_view name);

/// Sets the times of the device that is known; shutter_known where all are.
void set_shutter(const CameraDevice& device, CameraConfig& camera);

/// The device that made a recording of TUM or Bonn, known by its folder's name and its intrinsics.
/// Distorted intrinsics of theirs are enough: nobody else's agree to a hundredth of a pixel.
[[nodiscard]] const CameraDevice* recognised_device(std::string_view folder_name,
                                                    const CameraConfig& camera);

}  // namespace ygslam
