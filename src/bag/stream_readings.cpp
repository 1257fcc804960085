#include "bag/stream_readings.hpp"

#include "bag/bag_imu.hpp"
#include "bag/stamp_order.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr double kJudged_s = 2;
constexpr std::size_t kMostJudged = 10'000;  // whose stamps may stand still

template <typename T>
void push(std::deque<T>& waiting, T item) {
  waiting.push_back(std::move(item));
  if (waiting.size() > StreamReadings::kMostWaiting) waiting.pop_front();
}

}  // namespace

void StreamReadings::use(const std::string& topic) {
  topic_ = topic;
  for (const Reading& reading : std::exchange(early_, {}))
    if (reading.topic == topic) keep(reading.sample);
}

void StreamReadings::add(const BagTopic& topic, const BagMessage& message, std::int64_t shift_ns) {
  const bool is_wanted = topic_ ? topic.name == *topic_ : is_imu(topic);
  auto reading = is_wanted ? reading_of(topic, message) : std::nullopt;
  if (!reading || __builtin_add_overflow(reading->stamp.ns, shift_ns, &reading->stamp.ns)) return;
  if (topic_) {
    keep(*reading);
  } else {
    push(early_, {topic.name, *reading});
  }
}

void StreamReadings::keep(const ImuSample& reading) {
  push(newest_, reading);
  if (!is_judged_) judge(reading);
}

void StreamReadings::judge(const ImuSample& reading) {
  if (!first_.empty() && are_far_apart(first_.front().stamp, reading.stamp)) first_.clear();
  first_.push_back(reading);
  if (apart_s(first_.front().stamp, reading.stamp) < kJudged_s && first_.size() < kMostJudged)
    return;
  const ImuDoubt doubt = doubt_about_topic(in_order_of_time(std::exchange(first_, {})));
  if (!doubt.what.empty()) doubt_ = printable(*topic_) + ": " + doubt.what;
  is_judged_ = true;
}

void StreamReadings::hand_out(FrameId id) {
  if (!topic_) topic_.emplace();
  early_.clear();
  const std::scoped_lock lock(mutex_);
  for (const ImuSample& reading : newest_) push(handed_out_, {id, reading});
  newest_.clear();
}

std::vector<ImuSample> StreamReadings::take(FrameId id) {
  std::vector<ImuSample> taken;
  const std::scoped_lock lock(mutex_);
  for (; !handed_out_.empty() && handed_out_.front().first <= id; handed_out_.pop_front())
    taken.push_back(handed_out_.front().second);
  return taken;
}

}  // namespace ygslam
