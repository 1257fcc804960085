#include "bag/motion_topics.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "io/sensor_yaml.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kMostMoving = 10'000;

/// Of sensor_msgs/Imu the frame of the sensor, of nav_msgs/Odometry the one that moves.
struct SensorHead {
  ros::Header header;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header);
  }
};
struct MovingHead {
  ros::Header header;
  std::string child_frame_id;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header, m.child_frame_id);
  }
};

/// Of an IMU's or odometry's message; of others none.
std::optional<std::string> frame_of(const BagTopic& topic, const BagMessage& message) {
  SensorHead sensor;
  MovingHead moving;
  if (is_imu(topic) && from_cdr(message.bytes, sensor, topic.layout))
    return cut_name(sensor.header.frame_id);
  if (is_odometry(topic) && from_cdr(message.bytes, moving, topic.layout))
    return cut_name(moving.child_frame_id);
  return std::nullopt;
}

bool is_of_wheels(const MotionTopic& topic) {
  return topic.name.find("wheel") != std::string::npos;
}

}  // namespace

bool is_imu(const BagTopic& topic) { return topic.type == "sensor_msgs/Imu"; }
bool is_odometry(const BagTopic& topic) { return topic.type == "nav_msgs/Odometry"; }
bool is_moving_frame(const std::string& name) { return name.find(':') != std::string::npos; }

void MotionFrames::take(const BagTopic& topic, const BagMessage& message) {
  if (has_transforms(topic)) return take_moving(topic, message);
  const auto frame = frame_of(topic, message);
  if (!frame) return;
  const auto [first, is_new] = frames_.try_emplace(topic.name, *frame);
  if (!is_new && first->second != *frame && are_changed_.insert(topic.name).second)
    changes_[topic.name] = fmt::format("a later message is of the frame '{}', the first of '{}'",
                                       printable(*frame), printable(first->second));
}

std::string MotionFrames::take_change(const std::string& topic) {
  const auto change = changes_.extract(topic);
  return change ? change.mapped() : std::string();
}

/// Named as for_each_pose() names them.
void MotionFrames::take_moving(const BagTopic& topic, const BagMessage& message) {
  ros::TfMessage transforms;
  if (topic.name.ends_with("_static") || !from_cdr(message.bytes, transforms, topic.layout)) return;
  for (const ros::TransformStamped& transform : transforms.transforms) {
    if (moving_.size() >= kMostMoving) return;
    const std::string frame = frame_name(transform.child_frame_id);
    const std::string name = topic.name + ":" + frame;
    if (moving_.insert(name).second) frames_[name] = frame;
  }
}

bool MotionFrames::is_placed(const std::string& name, const FrameTree& frames,
                             const std::string& camera_frame) const {
  return placed(name, frames, camera_frame).T_frame_camera.has_value();
}

MotionTopic MotionFrames::placed(const std::string& name, const FrameTree& frames,
                                 const std::string& camera_frame) const {
  MotionTopic found{name};
  if (const auto change = changes_.find(name); change != changes_.end())
    found.changed = change->second;
  const auto frame = frames_.find(name);
  if (frame == frames_.end() || frame->second.empty() || camera_frame.empty()) {
    found.missing = "no message of " + printable(name) + " or of the images names a frame";
    return found;
  }
  const auto T_frame_camera =
      frames.T_target_source(frame->second, camera_frame, FrameTree::Trust::kStatic);
  const std::string frames_named =
      "of the frames '" + printable(frame->second) + "' and '" + printable(camera_frame) + "' ";
  if (!T_frame_camera.ok()) {
    found.missing = frames_named + "there is " + T_frame_camera.error().message;
  } else if (!(T_frame_camera->t().array().abs() <= kMostLever_m).all()) {
    found.missing = frames_named + "one is farther than 100 m from the other (metres are expected)";
  } else {
    found.T_frame_camera = *T_frame_camera;
  }
  return found;
}

/// A robot's base is hardly as near as the camera's frames are to each other (6 cm on a RealSense
/// D455), those by /tf_static; by /tf, which may be of anything, only what is about one place.
bool MotionFrames::moves_camera(const std::string& name, const FrameTree& frames,
                                const std::string& camera_frame) const {
  constexpr double kOfOnePlace_m = 0.02, kOfOneDevice_m = 0.1;
  const auto frame = frames_.find(name);
  if (frame == frames_.end() || frame->second.empty() || camera_frame.empty()) return false;
  const auto is_within = [&](double reach_m, FrameTree::Trust trust) {
    const auto T_frame_camera = frames.T_target_source(frame->second, camera_frame, trust);
    return T_frame_camera.ok() && T_frame_camera->t().norm() < reach_m;
  };
  const bool is_named_base = frame->second.find("base") != std::string::npos;  // base_footprint
  return is_within(kOfOnePlace_m, FrameTree::Trust::kFirst) ||
         (!is_named_base && is_within(kOfOneDevice_m, FrameTree::Trust::kStatic));
}

void MotionFrames::list(const std::vector<BagTopic>& topics, const FrameTree& frames,
                        const std::string& camera_frame, Sequence& sequence) const {
  for (const BagTopic& topic : topics) {
    if (!is_imu(topic) && !is_odometry(topic)) continue;
    auto& listed = is_imu(topic) ? sequence.imu_topics : sequence.odometry_topics;
    if (std::ranges::find(listed, topic.name, &MotionTopic::name) != listed.end()) continue;
    listed.push_back(placed(topic.name, frames, camera_frame));
    listed.back().is_camera = is_odometry(topic) && moves_camera(topic.name, frames, camera_frame);
  }
  for (const std::string& name : moving_)
    sequence.moving_frames.push_back(placed(name, frames, camera_frame));
  std::ranges::stable_partition(sequence.odometry_topics, is_of_wheels);
}

}  // namespace ygslam
