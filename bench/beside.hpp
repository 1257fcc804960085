// Two ways to solve one problem, in turn: the ratio of their processor times is worth more than
// either of them on a busy machine.
#pragma once

#include <benchmark/benchmark.h>

#include <ctime>
#include <string>
#include <utility>

namespace ygslam::bench {

[[nodiscard]] inline double thread_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Of the calling thread.
template <class F>
[[nodiscard]] double seconds(F&& work) {
  const double start = thread_cpu_seconds();
  std::forward<F>(work)();
  return thread_cpu_seconds() - start;
}

/// @param other the library: "opencv" gives counters opencv_ms and opencv_over_ours.
inline void report(benchmark::State& state, double ours_s, const std::string& other,
                   double other_s) {
  const auto runs = static_cast<double>(state.iterations());
  state.counters["ours_ms"] = 1e3 * ours_s / runs;
  state.counters[other + "_ms"] = 1e3 * other_s / runs;
  state.counters[other + "_over_ours"] = other_s / ours_s;
}

}  // namespace ygslam::bench
