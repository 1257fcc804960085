// Explicitly seeded randomness: every function that draws takes an Rng&.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace ygslam {

/// SplitMix64 (Steele, Lea, Flood 2014): small, fast, the same on every platform
/// (std:: distributions are not).
class Rng {
 public:
  explicit Rng(std::uint64_t seed) : state_(seed) {}

  [[nodiscard]] std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  /// Uniform in [0, n), n > 0.
  [[nodiscard]] std::uint32_t below(std::uint32_t n) {
    return static_cast<std::uint32_t>(((next() >> 32) * n) >> 32);
  }
  /// Uniform in [low, high).
  [[nodiscard]] double uniform(double low = 0.0, double high = 1.0) {
    return low + (high - low) * static_cast<double>(next() >> 11) * 0x1.0p-53;
  }
  /// Normal by Box-Muller.
  [[nodiscard]] double normal(double mean = 0.0, double sigma = 1.0) {
    const double u = 1.0 - uniform();
    const double v = uniform();
    return mean + sigma * std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * v);
  }

 private:
  std::uint64_t state_;
};

}  // namespace ygslam
