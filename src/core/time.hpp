// Integer time. Seconds as double appear only where a formula needs a duration.
#pragma once

#include <chrono>
#include <compare>
#include <cstdint>
#include <ctime>

namespace ygslam {

/// A sensor's time stamp in nanoseconds since its own epoch.
struct Timestamp {
  std::int64_t ns = 0;
  auto operator<=>(const Timestamp&) const = default;
};

/// @return a - b [s].
[[nodiscard]] constexpr double seconds_between(Timestamp a, Timestamp b) {
  return static_cast<double>(a.ns - b.ns) * 1e-9;
}

[[nodiscard]] constexpr std::int64_t to_ns(double seconds) {
  return static_cast<std::int64_t>(seconds * 1e9 + (seconds >= 0 ? 0.5 : -0.5));
}

/// CPU time of the calling thread.
[[nodiscard]] inline std::int64_t thread_cpu_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

/// Wall time and CPU time of the calling thread since construction [ms].
class ScopedTimer {
 public:
  ScopedTimer() : wall_(std::chrono::steady_clock::now()), cpu_ns_(thread_cpu_ns()) {}
  [[nodiscard]] double wall_ms() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - wall_)
        .count();
  }
  [[nodiscard]] double cpu_ms() const {
    return static_cast<double>(thread_cpu_ns() - cpu_ns_) * 1e-6;
  }

 private:
  std::chrono::steady_clock::time_point wall_;
  std::int64_t cpu_ns_;
};

}  // namespace ygslam
