// Which topics may tell how the camera moves, and where their sensors are on it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "bag/bag.hpp"
#include "bag/frame_tree.hpp"
#include "io/sequence.hpp"

namespace ygslam {

[[nodiscard]] bool is_imu(const BagTopic& topic);
[[nodiscard]] bool is_odometry(const BagTopic& topic);

/// The frames of their sensors, message by message.
class MotionFrames {
 public:
  void take(const BagTopic& topic, const BagMessage& message);
  /// A message of this topic has come.
  [[nodiscard]] bool knows(const BagTopic& topic) const { return frames_.contains(topic.name); }
  /// Its place is known.
  [[nodiscard]] bool is_placed(const BagTopic& topic, const FrameTree& frames,
                               const std::string& camera_frame) const;
  /// Fills in imu_topics and odometry_topics. Odometry may be anybody's, the truth, too: those that
  /// are named after wheels come first.
  /// @param topics of the recording. @param camera_frame of the colour images.
  void list(const std::vector<BagTopic>& topics, const FrameTree& frames,
            const std::string& camera_frame, Sequence& sequence) const;

 private:
  [[nodiscard]] MotionTopic placed(const BagTopic& topic, const FrameTree& frames,
                                   const std::string& camera_frame) const;
  std::map<std::string, std::string> frames_;  // by topic
};

}  // namespace ygslam
