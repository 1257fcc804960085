#include "bag/stream_readings.hpp"

#include <fmt/format.h>

#include "core/counted.hpp"
#include "io/text.hpp"

namespace ygslam {

Result<ImuTopics> StreamReadings::use(const std::string& choice,
                                      const std::vector<MotionTopic>& announced) {
  std::map<std::string, ImuReader::Source> sources;
  for (const MotionTopic& topic : announced) sources[topic.name];
  for (const Reading& reading : early_) sources[reading.topic].samples.push_back(reading.sample);
  auto chosen = choose_imu(sources, choice, "--imu");
  if (!chosen.ok()) return chosen;
  topics_ = *chosen;
  for (const Reading& reading : std::exchange(early_, {})) sort(reading);
  return chosen;
}

void StreamReadings::add(const BagTopic& topic, const BagMessage& message, std::int64_t shift_ns) {
  const bool is_wanted =
      !topics_ ||
      (!topics_->gyro.empty() && (topic.name == topics_->gyro || topic.name == topics_->accel));
  if (!is_wanted || !is_imu(topic)) return;
  auto reading = reading_of(topic, message);
  if (!reading) return leave_out(topic.name);
  if (__builtin_add_overflow(reading->stamp.ns, shift_ns, &reading->stamp.ns)) return;
  if (topics_) return sort({topic.name, *reading});
  early_.push_back({topic.name, *reading});
  if (early_.size() > FrameShares<ImuSample>::kMostWaiting) early_.pop_front();
}

/// Until a topic is chosen nobody knows whether it matters.
void StreamReadings::leave_out(const std::string& topic) {
  if (!topics_) return;
  ++left_out_;
  if (is_power_of_ten(left_out_))
    doubts_.push_back(fmt::format("{}: no finite numbers of sensible size in {} so far: left out",
                                  printable(topic), counted(left_out_, "reading")));
}

void StreamReadings::sort(const Reading& reading) {
  if (!topics_->are_halves()) {
    if (reading.topic == topics_->gyro) keep(reading.sample);
    return;
  }
  if (reading.topic == topics_->gyro) halves_.add_gyro(reading.sample);
  if (reading.topic == topics_->accel) halves_.add_accel(reading.sample);
  for (const ImuSample& whole : halves_.take()) keep(whole);
}

void StreamReadings::keep(const ImuSample& reading) {
  // Half an IMU, or a simulated one at rest, which says more once it moves.
  is_half_ = is_half_ &&
             (reading.angular_velocity_radps.isZero(0) || reading.specific_force_mps2.isZero(0));
  if (!is_half_) shares_.add(reading);
  auto first = first_.add(reading);
  if (first.empty()) return;
  const ImuDoubt doubt = doubt_about_topic(in_order_of_time(std::move(first)));
  is_half_ = doubt.is_fault;
  if (!doubt.what.empty()) doubts_.push_back(printable(topics_->gyro) + ": " + doubt.what);
}

void StreamReadings::hand_out(FrameId id) {
  if (!topics_) topics_.emplace();
  early_.clear();
  shares_.hand_out(id);
}

}  // namespace ygslam
