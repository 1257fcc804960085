#include "bag/stream_odometry.hpp"

#include <fmt/format.h>

#include "core/counted.hpp"
#include "io/text.hpp"
#include "io/wheel_file.hpp"

namespace ygslam {

Result<std::string> StreamOdometry::use(const std::string& choice,
                                        const std::vector<MotionTopic>& announced) {
  std::map<std::string, PoseSource> sources = early_.sources();
  // A path is told as a whole again and again; see for_each_pose().
  std::erase_if(sources, [](const auto& entry) { return entry.second.type == "nav_msgs/Path"; });
  for (const MotionTopic& topic : announced)
    if (PoseSource& source = sources[topic.name]; source.type.empty())
      source.type = "nav_msgs/Odometry";
  auto chosen = choose_poses(sources, choice, "--odometry");
  if (!chosen.ok()) return chosen;
  name_ = *chosen;
  const PoseSource& source = sources.at(*name_);
  for (const StampedPose& pose : source.poses) keep(pose);
  if (source.left_out > 0) leave_out(source.left_out);
  early_ = {};
  return chosen;
}

void StreamOdometry::add(const BagTopic& topic, const BagMessage& message, std::int64_t shift_ns) {
  if (!name_) return early_.take(topic, message);
  if (!name_->starts_with(topic.name)) return;  // "/tf" of "/tf:base"
  for_each_pose(topic, message, [&](const std::string& name, SaidPose said) {
    if (name != *name_) return;
    if (!said.T_world_body) return leave_out(1);
    if (__builtin_add_overflow(said.stamp.ns, shift_ns, &said.stamp.ns)) return;
    keep({said.stamp, *said.T_world_body});
  });
}

void StreamOdometry::leave_out(std::size_t count) {
  const bool is_first = left_out_ == 0;
  left_out_ += count;
  if (is_first || is_power_of_ten(left_out_))
    doubts_.push_back(
        fmt::format("{}: no finite numbers and unit quaternion in {} so far: left out",
                    printable(*name_), counted(left_out_, "pose")));
}

void StreamOdometry::keep(const StampedPose& pose) {
  shares_.add({pose.stamp, pose.T_world_camera});
  auto first = first_.add(pose);
  if (first.empty()) return;
  const auto wheels = wheels_of_poses(in_order_of_time(std::move(first)));
  if (!wheels.ok()) doubts_.push_back(printable(*name_) + ": " + wheels.error().message);
}

void StreamOdometry::hand_out(FrameId id) {
  if (!name_) name_.emplace();
  early_ = {};
  shares_.hand_out(id);
}

}  // namespace ygslam
