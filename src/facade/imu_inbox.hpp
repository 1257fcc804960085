// Readings of an IMU on their way from the thread that reads the sensor to the one that tracks.
#pragma once

#include <mutex>
#include <utility>
#include <vector>

#include "geometry/imu.hpp"

namespace ygslam::api {

class ImuInbox {
 public:
  void put(const ImuSample& sample) {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= kMost) waiting_.clear();  // nobody tracks: a gap is a gap
    waiting_.push_back(sample);
  }
  /// All that came since, in their order.
  [[nodiscard]] std::vector<ImuSample> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(waiting_, {});
  }

 private:
  static constexpr std::size_t kMost = 10000;  // ten seconds of the fastest
  std::mutex mutex_;
  std::vector<ImuSample> waiting_;
};

}  // namespace ygslam::api
