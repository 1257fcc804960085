// Readings of an IMU or of wheels on their way from the thread that reads the sensor to the one
// that tracks.
#pragma once

#include <mutex>
#include <utility>
#include <vector>

namespace ygslam::api {

template <typename Sample>
class MotionInbox {
 public:
  void put(const Sample& sample) {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= kMost) waiting_.clear();  // nobody tracks: a gap is a gap
    waiting_.push_back(sample);
  }
  /// All that came since, in their order.
  [[nodiscard]] std::vector<Sample> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(waiting_, {});
  }

 private:
  static constexpr std::size_t kMost = 10000;  // ten seconds of the fastest
  std::mutex mutex_;
  std::vector<Sample> waiting_;
};

}  // namespace ygslam::api
