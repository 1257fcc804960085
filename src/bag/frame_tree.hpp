// How the frames of a recording stand to each other, as far as that never changes.
#pragma once

#include <map>
#include <string>

#include "bag/bag.hpp"
#include "bag/ros_messages.hpp"
#include "core/result.hpp"

namespace ygslam {

/// A frame's name without the slash that ROS 1 may put before it.
[[nodiscard]] std::string frame_name(const std::string& frame);
/// Whether two images are of frames that are named, and not the same.
[[nodiscard]] bool are_other_frames(const std::string& a, const std::string& b);

/// Whether a topic has transforms: tf2_msgs/TFMessage, or ROS 1's older tf/tfMessage.
[[nodiscard]] bool has_transforms(const BagTopic& topic);

/// The tree of ROS's coordinate frames (REP 105). Of each frame the first transform is kept, and
/// one of /tf_static goes before those of /tf: between the two cameras of a device both are fixed.
class FrameTree {
 public:
  enum class Trust {
    kFirst,   ///< also what /tf said first
    kStatic,  ///< /tf_static alone
  };
  /// @param topic with transforms. What cannot be read, or is no rigid motion, is passed over.
  void take(const BagTopic& topic, std::span<const std::uint8_t> bytes);
  /// Names may begin with a slash, as in ROS 1. @return kInput where no transforms connect them:
  /// what there is none of, and whether limits are why.
  [[nodiscard]] Result<SE3> T_target_source(const std::string& target, const std::string& source,
                                            Trust trust = Trust::kFirst) const;

 private:
  struct Edge {
    std::string parent;
    SE3 T_parent_child;
    bool is_static = false;
  };
  std::map<std::string, Edge> edge_of_;  // by the child's name
  bool left_out_ = false;                // frames beyond the most that are kept
};

}  // namespace ygslam
