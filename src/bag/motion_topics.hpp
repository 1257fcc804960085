// Which topics may tell how the camera moves, and where their sensors are on it.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "bag/bag.hpp"
#include "bag/frame_tree.hpp"
#include "io/sequence.hpp"

namespace ygslam {

[[nodiscard]] bool is_imu(const BagTopic& topic);
[[nodiscard]] bool is_odometry(const BagTopic& topic);

/// A frame of a topic with transforms, "/tf:child", and no topic.
[[nodiscard]] bool is_moving_frame(const std::string& name);

/// The frames of their sensors, message by message, and those that /tf moves.
class MotionFrames {
 public:
  void take(const BagTopic& topic, const BagMessage& message);
  /// A message of this topic, or of this moving frame, has come.
  [[nodiscard]] bool knows(const std::string& name) const { return frames_.contains(name); }
  /// That messages of a topic name another frame than its first, which counts; said once.
  /// @return empty: they do not.
  [[nodiscard]] std::string take_change(const std::string& topic);
  /// Its place is known.
  [[nodiscard]] bool is_placed(const std::string& name, const FrameTree& frames,
                               const std::string& camera_frame) const;
  /// Fills in imu_topics, odometry_topics and moving_frames. Odometry may be anybody's, the truth,
  /// too: those that are named after wheels come first.
  /// @param topics of the recording. @param camera_frame of the colour images.
  void list(const std::vector<BagTopic>& topics, const FrameTree& frames,
            const std::string& camera_frame, Sequence& sequence) const;

 private:
  void take_moving(const BagTopic& topic, const BagMessage& message);
  [[nodiscard]] MotionTopic placed(const std::string& name, const FrameTree& frames,
                                   const std::string& camera_frame) const;
  [[nodiscard]] bool moves_camera(const std::string& name, const FrameTree& frames,
                                  const std::string& camera_frame) const;
  std::map<std::string, std::string> frames_;   // by name
  std::map<std::string, std::string> changes_;  // of topics, as text
  std::set<std::string> are_changed_;           // topics
  std::set<std::string> moving_;                // names of those of /tf
};

}  // namespace ygslam
