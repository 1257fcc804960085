// How one thread asks another to end a long computation early.
#pragma once

#include <atomic>

namespace ygslam {

/// @param abort null = nobody can ask. Once set it is to stay so until the computation has
/// returned.
[[nodiscard]] inline bool is_stopped(const std::atomic<bool>* abort) {
  return abort != nullptr && abort->load(std::memory_order_relaxed);
}

}  // namespace ygslam
