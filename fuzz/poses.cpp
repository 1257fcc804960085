#include <array>
#include <cmath>

#include "bag/bag_trajectory.hpp"
#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "io/associated_poses.hpp"
#include "io/folder_truth.hpp"

namespace ygslam::fuzz {
namespace {

void check(const SE3& T_world_camera) {
  CHECK(T_world_camera.is_finite());
  CHECK(std::abs(T_world_camera.R().determinant() - 1) < 1e-3);
}

}  // namespace

/// One pose a file, lists of associations with poses, and the messages of bags that have poses (the
/// first byte says which).
void poses(std::string_view bytes) {
  if (bytes.empty()) return;
  const auto kind = static_cast<unsigned char>(bytes.front());
  const std::string_view rest = bytes.substr(1);
  if (const auto pose = parse_pose_file(rest); pose.ok() && pose.value()) check(**pose);
  if (const auto text = poses_of_associations(rest)) (void)parse_trajectory(*text, "list");
  constexpr std::array<const char*, 6> kTypes = {"nav_msgs/Odometry",
                                                 "nav_msgs/Path",
                                                 "geometry_msgs/PoseStamped",
                                                 "geometry_msgs/PoseWithCovarianceStamped",
                                                 "geometry_msgs/TransformStamped",
                                                 "tf2_msgs/TFMessage"};
  const BagTopic topic{"/t", kTypes[kind % kTypes.size()],
                       (kind & 128) != 0 ? Layout::kRos1 : Layout::kCdr};
  const std::span<const std::uint8_t> content(reinterpret_cast<const std::uint8_t*>(rest.data()),
                                              rest.size());
  PoseReader reader;
  for (int i = 0; i < 2; ++i) reader.take(topic, {0, {5}, content, {}});
  const auto chosen = chosen_trajectory(reader.sources(), "", "--gt-topic");
  if (!chosen.ok()) {
    CHECK(chosen.error().message.find('\n') == std::string::npos, "a fault is one line");
    return;
  }
  for (std::size_t i = 0; i < chosen->poses.size(); ++i) {
    check(chosen->poses[i].T_world_camera);
    CHECK(i == 0 || chosen->poses[i - 1].stamp < chosen->poses[i].stamp);
  }
}

}  // namespace ygslam::fuzz
