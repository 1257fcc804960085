// Frames as callers have them, made into the system's: checked and copied.
#pragma once

#include <memory>
#include <optional>

#include "image/depth.hpp"
#include "image/rgbd_frame.hpp"
#include "io/depth_registration.hpp"
#include "segment/segmenter.hpp"
#include "ygslam/slam.hpp"

namespace ygslam::api {

/// Nobody else has it yet: whoever processes it gives it its number.
struct Input {
  std::shared_ptr<RgbdFrame> frame;
  std::shared_ptr<Segmentation> masks{};  ///< null: it came without
  std::optional<SE3> T_now_last{};        ///< the camera's motion since the frame before
  std::int64_t clock_shift_ns = 0;
};

struct InputFormat {
  CameraConfig camera;
  std::shared_ptr<const DepthRegistration> registration{};  ///< null: depth is registered
  DepthConfig depth{};
  bool takes_instances = false;
};

/// With the stamp as it is. @throws Error (4) in one line.
[[nodiscard]] Input read_input(const Frame& frame, const InputFormat& format);

}  // namespace ygslam::api
