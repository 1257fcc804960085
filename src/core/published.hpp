// The newest immutable snapshot of a state: one writer stores, any reader loads, nobody holds a
// lock while using it.
#pragma once

#include <memory>
#include <mutex>
#include <utility>

namespace ygslam {

template <typename T>
class Published {
 public:
  using Ptr = std::shared_ptr<const T>;
  explicit Published(Ptr initial = nullptr) : current_(std::move(initial)) {}

  void store(Ptr next) {
    const std::lock_guard lock(mutex_);  // held for a pointer swap; the old value dies outside
    current_.swap(next);
  }
  [[nodiscard]] Ptr load() const {
    const std::lock_guard lock(mutex_);
    return current_;
  }

 private:
  mutable std::mutex mutex_;
  Ptr current_;
};

}  // namespace ygslam
