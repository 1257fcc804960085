// Which messages of a recording are the sequence, and of which camera.
#pragma once

#include <optional>

#include "bag/bag_images.hpp"
#include "bag/bag_sequence.hpp"

namespace ygslam {

struct BagChoice {
  const ImageTopic* colour = nullptr;
  const ImageTopic* depth = nullptr;
  CameraConfig camera;
  std::string camera_source;
  bool camera_changes = false;  ///< what its topic says later
  std::optional<DepthCamera> depth_camera;
  std::string depth_camera_source;
  bool depth_camera_changes = false;
  std::string depth_missing;  ///< why depth of another frame cannot be registered; empty: nothing
};

/// @param cameras in place of the recording's own.
/// @return kInput or kConfig, with a reason alone: what is missing or may be meant in several ways.
[[nodiscard]] Result<BagChoice> choose(const BagContent& content, const BagTopics& topics,
                                       const GivenCameras& cameras);

/// Says it where colour and depth are of different frames, or the camera changes.
void warn_of_choice(const BagChoice& choice, Sequence& sequence);

}  // namespace ygslam
