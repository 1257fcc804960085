// Splits independent work over a few threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <vector>

#include "core/worker_thread.hpp"

namespace ygslam {

/// Calls work(i) for i in [0, count), on up to `threads` threads (the caller is one of them).
/// The calls must not depend on each other, so the result does not depend on `threads`. What one of
/// them throws is thrown here.
template <typename Work>
void parallel_for(int count, int threads, const Work& work) {
  std::atomic<int> next{0};
  const auto drain = [&] {
    for (int i = next.fetch_add(1); i < count; i = next.fetch_add(1)) work(i);
  };
  std::vector<WorkerThread> helpers;
  for (int i = 1; i < std::min(threads, count); ++i)
    helpers.emplace_back([&drain](const std::stop_token&) { drain(); });
  drain();
  for (WorkerThread& helper : helpers) {
    helper.join();
    helper.rethrow();
  }
}

}  // namespace ygslam
