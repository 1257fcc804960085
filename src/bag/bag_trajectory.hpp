// Trajectories out of bags: odometry, poses, paths and transforms.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "bag/bag.hpp"
#include "bag/ros_messages.hpp"
#include "core/result.hpp"
#include "io/trajectory_formats.hpp"

namespace ygslam {

/// The poses of a topic, or of one frame of a topic with transforms.
struct PoseSource {
  std::string type;
  std::vector<StampedPose> poses;  ///< of a Path those of its last message
  std::size_t left_out = 0;        ///< no unit quaternion, not finite, or more than are kept
};

/// Collects poses, message by message: nav_msgs/Odometry and Path, geometry_msgs/PoseStamped,
/// PoseWithCovarianceStamped and TransformStamped, tf2_msgs/TFMessage.
class PoseReader {
 public:
  void take(const BagTopic& topic, const BagMessage& message);
  /// By name: the topic, or "/tf:child" for a frame of a topic with transforms.
  [[nodiscard]] const std::map<std::string, PoseSource>& sources() const { return sources_; }

 private:
  void add(const std::string& name, const BagTopic& topic, Timestamp stamp, const ros::Pose& pose);
  std::map<std::string, PoseSource> sources_;
  std::size_t count_ = 0;
};

/// @param choice a topic, or "/tf:child"; empty: the only one that is no transform.
/// @param option that chooses, for messages.
/// @return kInput with a reason alone: none, several, or not one pose with a stamp in it.
[[nodiscard]] Result<TrajectoryFile> chosen_trajectory(
    const std::map<std::string, PoseSource>& sources, const std::string& choice,
    std::string_view option);

/// Reads through the whole bag; what was taken is logged. @return as above, with the path.
[[nodiscard]] Result<TrajectoryFile> read_bag_trajectory(const std::filesystem::path& path,
                                                         const std::string& choice,
                                                         std::string_view option);

}  // namespace ygslam
