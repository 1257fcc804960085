// One slot, newest wins: for consumers to whom an old message is worthless.
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>

namespace ygslam {

template <typename T>
class Mailbox {
 public:
  /// Never blocks; replaces what was not yet taken.
  void put(T value) {
    {
      const std::lock_guard lock(mutex_);
      slot_ = std::move(value);
    }
    available_.notify_one();
  }
  /// Waits for a message. @return nullopt once stopped.
  std::optional<T> take(std::stop_token stop) {
    std::unique_lock lock(mutex_);
    available_.wait(lock, stop, [&] { return slot_.has_value(); });
    if (stop.stop_requested()) return std::nullopt;
    return std::exchange(slot_, std::nullopt);
  }
  std::optional<T> try_take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(slot_, std::nullopt);
  }

 private:
  std::mutex mutex_;
  std::condition_variable_any available_;
  std::optional<T> slot_;
};

}  // namespace ygslam
