// Order statistics of a stream whose length nobody knows: bins that grow by a fixed ratio.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace ygslam {

/// Counts of non-negative values. Percentiles are right to half a per cent, mean and maximum exact;
/// the memory does not grow.
class Histogram {
 public:
  void add(double value) {
    value = std::isfinite(value) ? std::max(0.0, value) : 0.0;
    ++bins_[bin(value)];
    ++count_;
    sum_ += value;
    max_ = std::max(max_, value);
  }
  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] double mean() const { return count_ ? sum_ / static_cast<double>(count_) : 0; }
  [[nodiscard]] double max() const { return max_; }
  /// The value at the nearest rank; 0 without values. @param share in (0, 1].
  [[nodiscard]] double percentile(double share) const {
    const auto rank = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < bins_.size(); ++i) {
      below += bins_[i];
      if (below >= std::max<std::uint64_t>(rank, 1)) return std::min(middle(i), max_);
    }
    return max_;
  }

 private:
  static constexpr double kSmallest = 1e-4;  // below it everything is the same
  static constexpr double kRatio = 1.01;
  static constexpr std::size_t kBins = 2400;  // up to 2e6

  [[nodiscard]] static std::size_t bin(double value) {
    if (value < kSmallest) return 0;
    const double place = 1 + std::log(value / kSmallest) / std::log(kRatio);
    return std::min(kBins - 1, static_cast<std::size_t>(place));
  }
  [[nodiscard]] static double middle(std::size_t bin) {
    return bin == 0 ? 0.0 : kSmallest * std::pow(kRatio, static_cast<double>(bin) - 0.5);
  }

  std::array<std::uint64_t, kBins> bins_{};
  std::uint64_t count_ = 0;
  double sum_ = 0;
  double max_ = 0;
};

}  // namespace ygslam
