// Splits independent work over a few threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace ygslam::sim {

/// Calls work(i) for i in [0, count), on up to `threads` threads (the caller is one of them).
/// The calls must not depend on each other, so the result does not depend on `threads`.
template <typename Work>
void parallel_for(int count, int threads, const Work& work) {
  std::atomic<int> next{0};
  const auto drain = [&] {
    for (int i = next.fetch_add(1); i < count; i = next.fetch_add(1)) work(i);
  };
  std::vector<std::jthread> helpers;
  for (int i = 1; i < std::min(threads, count); ++i) helpers.emplace_back(drain);
  drain();
}

}  // namespace ygslam::sim
