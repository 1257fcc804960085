// Our Lucas-Kanade flow beside OpenCV's: accuracy on warps with exact truth, agreement and time on
// recorded frames.
#pragma once

#include <optional>
#include <vector>

#include "features/feature.hpp"
#include "geometry/camera.hpp"
#include "image/image.hpp"

namespace ygslam::bench {

struct FlowPicture {
  const GreyImage* grey = nullptr;
  const Features* features = nullptr;
  std::optional<SE3> T_world_camera;  ///< truth, where it is known
};

/// Rendered texture at twice the size, seen before and after six kinds of small motion.
void print_flow_accuracy();

/// Consecutive frames; guesses come from the true motion one frame earlier, as a tracker that
/// expects constant velocity would make them.
void print_flow_agreement(const std::vector<FlowPicture>& sequence, const Camera& camera);

}  // namespace ygslam::bench
