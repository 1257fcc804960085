// The beginning of what a sensor tells, to be judged at once.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "bag/stamp_order.hpp"

namespace ygslam {

template <typename Sample>
class FirstSeconds {
 public:
  /// @return once two seconds have come these, else nothing. Where stamps leap it begins anew.
  [[nodiscard]] std::vector<Sample> add(const Sample& sample) {
    constexpr double kLong_s = 2;
    constexpr std::size_t kMost = 10'000;  // of stamps that stand still
    if (is_over_) return {};
    if (!first_.empty() && are_far_apart(first_.front().stamp, sample.stamp)) first_.clear();
    first_.push_back(sample);
    is_over_ = apart_s(first_.front().stamp, sample.stamp) >= kLong_s || first_.size() >= kMost;
    return is_over_ ? std::exchange(first_, {}) : std::vector<Sample>();
  }

 private:
  std::vector<Sample> first_;
  bool is_over_ = false;
};

}  // namespace ygslam
