#include "bag/stream_readings.hpp"

#include <algorithm>

#include "bag/bag_imu.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kMostWaitingReadings = 100'000;  // that nobody has taken: minutes

}  // namespace

void StreamReadings::use(const std::string& topic) {
  topic_ = topic;
  for (const Reading& reading : std::exchange(early_, {}))
    if (reading.topic == topic) newest_.push_back(reading.sample);
}

void StreamReadings::add(const BagTopic& topic, const BagMessage& message, std::int64_t shift_ns) {
  const bool is_wanted = topic_ ? topic.name == *topic_ : is_imu(topic);
  auto reading = is_wanted ? reading_of(topic, message) : std::nullopt;
  if (!reading || std::max(early_.size(), newest_.size()) >= kMostWaitingReadings) return;
  reading->stamp.ns += shift_ns;
  if (topic_) {
    newest_.push_back(*reading);
  } else {
    early_.push_back({topic.name, *reading});
  }
}

void StreamReadings::hand_out(FrameId id) {
  if (!topic_) topic_.emplace();
  early_.clear();
  const std::scoped_lock lock(mutex_);
  for (const ImuSample& reading : newest_) handed_out_.emplace_back(id, reading);
  newest_.clear();
  while (handed_out_.size() > kMostWaitingReadings) handed_out_.pop_front();
}

std::vector<ImuSample> StreamReadings::take(FrameId id) {
  std::vector<ImuSample> taken;
  const std::scoped_lock lock(mutex_);
  for (; !handed_out_.empty() && handed_out_.front().first <= id; handed_out_.pop_front())
    taken.push_back(handed_out_.front().second);
  return taken;
}

}  // namespace ygslam
