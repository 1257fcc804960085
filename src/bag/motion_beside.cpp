#include "bag/motion_beside.hpp"

#include <algorithm>

#include "io/text.hpp"

namespace ygslam {

void MotionBeside::add(const BagTopic& topic, const BagMessage& message, std::int64_t shift_ns) {
  if (!is_listed_ || !has_transforms(topic)) sensors_.take(topic, message);
  if (!is_listed_ && has_transforms(topic)) frames_.take(topic, message.bytes);
  readings_.add(topic, message, shift_ns);
  odometry_.add(topic, message, shift_ns);
}

bool MotionBeside::is_there(const WantedMotion& wanted, const std::vector<BagTopic>& announced,
                            const std::string& camera_frame) const {
  const auto is_known = [&](const WantedMotion::Sensor& sensor, bool (*is_kind)(const BagTopic&)) {
    const auto has_come = [&](const std::string& name) {
      return sensor.by_tf ? sensors_.is_placed(name, frames_, camera_frame) : sensors_.knows(name);
    };
    if (!sensor.is_wanted) return true;
    if (is_moving_frame(sensor.name)) return has_come(sensor.name);
    return std::ranges::any_of(announced, is_kind) &&
           std::ranges::all_of(announced, [&](const BagTopic& topic) {
             return !is_kind(topic) || has_come(topic.name);
           });
  };
  return is_known(wanted.imu, is_imu) && is_known(wanted.wheels, is_odometry);
}

void MotionBeside::list(const std::vector<BagTopic>& announced, const std::string& camera_frame,
                        Sequence& sequence) {
  sensors_.list(announced, frames_, camera_frame, sequence);
  imu_topics_ = sequence.imu_topics;
  odometry_topics_ = sequence.odometry_topics;
  is_listed_ = true;
}

Result<std::string> MotionBeside::use_imu(const std::string& choice) {
  auto chosen = readings_.use(choice, imu_topics_);
  if (!chosen.ok()) return chosen.error();
  return chosen_imu_ = std::move(chosen->gyro);
}

Result<std::string> MotionBeside::use_odometry(const std::string& choice) {
  auto chosen = odometry_.use(choice, odometry_topics_);
  if (chosen.ok()) chosen_odometry_ = *chosen;
  return chosen;
}

void MotionBeside::hand_out(FrameId id) {
  readings_.hand_out(id);
  odometry_.hand_out(id);
}

std::vector<std::string> MotionBeside::take_doubts() {
  std::vector<std::string> doubts = readings_.take_doubts();
  for (std::string& doubt : odometry_.take_doubts()) doubts.push_back(std::move(doubt));
  for (const std::string* topic : {&chosen_imu_, &chosen_odometry_})
    if (const std::string change = sensors_.take_change(*topic); !change.empty())
      doubts.push_back(printable(*topic) + ": " + change);
  return doubts;
}

}  // namespace ygslam
