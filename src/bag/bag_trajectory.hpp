// Trajectories out of bags: odometry, poses, paths and transforms.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bag/bag.hpp"
#include "bag/ros_messages.hpp"
#include "core/result.hpp"
#include "io/trajectory_formats.hpp"

namespace ygslam {

/// A pose in a message. No unit quaternion, or not finite: none.
struct SaidPose {
  Timestamp stamp;
  std::optional<SE3> T_world_body;
};
/// @param name of the topic, or "/tf:child" for a frame of a topic with transforms.
using PoseTaker = std::function<void(const std::string& name, const SaidPose& said)>;
/// Of nav_msgs/Odometry, geometry_msgs/PoseStamped, PoseWithCovarianceStamped and TransformStamped,
/// tf2_msgs/TFMessage; of others none.
void for_each_pose(const BagTopic& topic, const BagMessage& message, const PoseTaker& take);

/// The poses of a topic, or of one frame of a topic with transforms.
struct PoseSource {
  std::string type;
  std::vector<StampedPose> poses;  ///< of a Path those of its last message
  std::size_t left_out = 0;        ///< no unit quaternion, not finite, or more than are kept
};

/// Collects poses, message by message: those above, and nav_msgs/Path.
class PoseReader {
 public:
  void take(const BagTopic& topic, const BagMessage& message);
  /// By name.
  [[nodiscard]] const std::map<std::string, PoseSource>& sources() const { return sources_; }

 private:
  void add(const std::string& name, const BagTopic& topic, const SaidPose& said);
  std::map<std::string, PoseSource> sources_;
  std::size_t count_ = 0;
};

/// Stably by stamps; of equal ones the first.
[[nodiscard]] std::vector<StampedPose> in_order_of_time(std::vector<StampedPose> poses);

/// @param choice a topic, or "/tf:child"; empty: the only one that is no transform.
/// @param option that chooses, for messages.
/// @return its name, or kInput with a reason alone: none, several.
[[nodiscard]] Result<std::string> choose_poses(const std::map<std::string, PoseSource>& sources,
                                               const std::string& choice, std::string_view option);
/// @return as above, or not one pose with a stamp in it.
[[nodiscard]] Result<TrajectoryFile> chosen_trajectory(
    const std::map<std::string, PoseSource>& sources, const std::string& choice,
    std::string_view option);

/// Of a bag.
enum class Damage {
  kIsTold,
  kWasTold,  ///< when it was opened as a sequence
};
/// Reads through the whole bag; what was taken is logged. @return as above, with the path.
[[nodiscard]] Result<TrajectoryFile> read_bag_trajectory(const std::filesystem::path& path,
                                                         const std::string& choice,
                                                         std::string_view option,
                                                         Damage damage = Damage::kIsTold);

}  // namespace ygslam
