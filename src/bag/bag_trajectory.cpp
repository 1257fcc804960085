#include "bag/bag_trajectory.hpp"

#include <algorithm>
#include <cmath>

#include "bag/frame_tree.hpp"
#include "bag/ros_messages.hpp"
#include "core/log.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kMostPoses = 4'000'000;  // of all topics together
constexpr std::size_t kMostSources = 10'000;
constexpr std::string_view kPathType = "nav_msgs/Path";

/// geometry_msgs/PoseStamped; with covariance the same begins it.
struct PoseHead {
  ros::Header header;
  ros::Pose pose;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header, m.pose);
  }
};
/// nav_msgs/Odometry and geometry_msgs/TransformStamped, as far as they are used.
struct ChildPoseHead {
  ros::Header header;
  std::string child_frame_id;
  ros::Pose pose;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header, m.child_frame_id, m.pose);
  }
};

Timestamp stamp_of(const ros::Header& header, Timestamp logged) {
  const Timestamp stamp = ros::from_ros(header.stamp);
  return stamp.ns == 0 ? logged : stamp;
}

std::optional<SE3> finite_pose(const ros::Pose& pose) {
  constexpr double kNormTolerance = 0.02;
  const auto& q = pose.orientation;
  const Eigen::Quaterniond rotation(q.w, q.x, q.y, q.z);
  const Vec3 t(pose.position.x, pose.position.y, pose.position.z);
  if (!(std::abs(rotation.norm() - 1) < kNormTolerance) || !t.allFinite()) return std::nullopt;
  return SE3(rotation.normalized(), t);
}

bool is_pose_type(const std::string& type) {
  return type == "geometry_msgs/PoseStamped" || type == "geometry_msgs/PoseWithCovarianceStamped";
}
bool is_child_type(const std::string& type) {
  return type == "nav_msgs/Odometry" || type == "geometry_msgs/TransformStamped";
}

/// "/odom (nav_msgs/Odometry, 300 poses), ...", of many the first.
std::string listed(const std::map<std::string, PoseSource>& sources) {
  constexpr std::size_t kMost = 8;
  std::string text;
  for (std::size_t i = 0; const auto& [name, source] : sources) {
    if (i == kMost) return text + ", ...";
    text += (i++ == 0 ? "" : ", ") + printable(name) + " (" + printable(source.type) + ", " +
            std::to_string(source.poses.size()) + " poses)";
  }
  return text;
}

}  // namespace

void for_each_pose(const BagTopic& topic, const BagMessage& message, const PoseTaker& take) {
  if (is_pose_type(topic.type)) {
    PoseHead head;
    if (from_cdr(message.bytes, head, topic.layout))
      take(topic.name, {stamp_of(head.header, message.logged), finite_pose(head.pose)});
  } else if (is_child_type(topic.type)) {
    ChildPoseHead head;
    if (from_cdr(message.bytes, head, topic.layout))
      take(topic.name, {stamp_of(head.header, message.logged), finite_pose(head.pose)});
  } else if (has_transforms(topic) && !topic.name.ends_with("_static")) {
    ros::TfMessage transforms;
    if (!from_cdr(message.bytes, transforms, topic.layout)) return;
    for (const ros::TransformStamped& transform : transforms.transforms)
      take(topic.name + ":" + frame_name(transform.child_frame_id),
           {stamp_of(transform.header, message.logged), finite_pose(transform.transform)});
  }
}

void PoseReader::add(const std::string& name, const BagTopic& topic, const SaidPose& said) {
  if (sources_.size() >= kMostSources && !sources_.contains(name)) return;
  PoseSource& source = sources_[name];
  if (source.type.empty()) source.type = topic.type;
  if (!said.T_world_body || count_ >= kMostPoses) {
    ++source.left_out;
    return;
  }
  ++count_;
  source.poses.push_back({said.stamp, *said.T_world_body});
}

void PoseReader::take(const BagTopic& topic, const BagMessage& message) {
  for_each_pose(topic, message,
                [&](const std::string& name, const SaidPose& said) { add(name, topic, said); });
  if (topic.type != kPathType) return;
  ros::Path path;
  if (!from_cdr(message.bytes, path, topic.layout) || path.poses.empty()) return;
  if (const auto known = sources_.find(topic.name); known != sources_.end()) {
    count_ -= known->second.poses.size();
    sources_.erase(known);
  }
  for (const ros::PoseStamped& pose : path.poses)
    add(topic.name, topic, {ros::from_ros(pose.header.stamp), finite_pose(pose.pose)});
}

std::vector<StampedPose> in_order_of_time(std::vector<StampedPose> poses) {
  std::ranges::stable_sort(poses, {}, &StampedPose::stamp);
  const auto doubles = std::ranges::unique(poses, {}, &StampedPose::stamp);
  poses.erase(doubles.begin(), doubles.end());
  return poses;
}

Result<std::string> choose_poses(const std::map<std::string, PoseSource>& sources,
                                 const std::string& choice, std::string_view option) {
  const auto refuse = [](std::string text) { return Error{ErrorKind::kInput, std::move(text)}; };
  const std::string there = sources.empty() ? "" : "; there are " + listed(sources);
  const auto is_transform = [](const auto& entry) {
    return entry.first.find(':') != std::string::npos;
  };
  auto found = sources.find(choice);
  if (choice.empty()) {
    found = std::find_if_not(sources.begin(), sources.end(), is_transform);
    if (found == sources.end() && sources.size() == 1) found = sources.begin();
    if (found == sources.end())
      return refuse(
          "no topic with poses (Odometry, PoseStamped, PoseWithCovarianceStamped, "
          "TransformStamped, Path)" +
          there + (sources.empty() ? "" : "; choose with " + std::string(option)));
    if (std::find_if_not(std::next(found), sources.end(), is_transform) != sources.end())
      return refuse("several topics have poses: " + listed(sources) + "; choose with " +
                    std::string(option));
  }
  if (found == sources.end())
    return refuse("no poses under " + std::string(option) + " " + printable(choice) + there);
  return found->first;
}

Result<TrajectoryFile> chosen_trajectory(const std::map<std::string, PoseSource>& sources,
                                         const std::string& choice, std::string_view option) {
  const auto chosen = choose_poses(sources, choice, option);
  if (!chosen.ok()) return chosen.error();
  const PoseSource& source = sources.at(*chosen);
  TrajectoryFile file;
  file.topic = *chosen;
  file.poses = in_order_of_time(source.poses);
  if (file.poses.empty() || file.poses.back().stamp.ns == 0)
    return Error{ErrorKind::kInput,
                 printable(*chosen) + ": no pose in it has a stamp and a unit quaternion"};
  file.taken_for = std::to_string(file.poses.size()) + " poses of " + printable(*chosen) + " (" +
                   printable(source.type) + ")";
  const std::size_t left_out = source.left_out + source.poses.size() - file.poses.size();
  if (left_out > 0)
    file.taken_for += ", " + std::to_string(left_out) + " left out: doubled or no unit quaternion";
  return file;
}

Result<TrajectoryFile> read_bag_trajectory(const std::filesystem::path& path,
                                           const std::string& choice, std::string_view option,
                                           Damage damage) {
  auto bag = open_bag(path);
  if (!bag.ok()) return bag.error();
  PoseReader reader;
  const Status visited = (*bag)->visit(
      [&](const BagMessage& message) { reader.take((*bag)->topics()[message.topic], message); },
      {});
  if (!visited.ok()) return visited.error();
  if (damage == Damage::kIsTold)
    for (const std::string& warning : (*bag)->warnings()) log::warn("{}", warning);
  auto file = chosen_trajectory(reader.sources(), choice, option);
  if (!file.ok()) return Error{ErrorKind::kInput, path.string() + ": " + file.error().message};
  log::info("{}: {}", path.string(), file->taken_for);
  return file;
}

}  // namespace ygslam
