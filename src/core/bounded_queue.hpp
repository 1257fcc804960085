// A queue between two threads with a fixed capacity and a named policy for when it is full.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>

#include "core/trace.hpp"

namespace ygslam {

enum class Overflow {
  kBlock,       ///< push waits for room
  kDropOldest,  ///< push discards the oldest entry and counts it
};

template <typename T>
class BoundedQueue {
 public:
  /// @param name in traces; it lives as long as the program. Null: not of interest.
  BoundedQueue(std::size_t capacity, Overflow overflow, const char* name = nullptr)
      : capacity_(capacity), overflow_(overflow), name_(name) {}

  /// @return false if the queue is closed (the value is discarded).
  bool push(T value) {
    std::unique_lock lock(mutex_);
    if (overflow_ == Overflow::kBlock) {
      const auto is_over = [&] { return items_.size() < capacity_ || closed_; };
      trace::wait(trace::Kind::kFull, name_, is_over, [&] { room_.wait(lock, is_over); });
    }
    if (closed_) return false;
    if (items_.size() >= capacity_) {
      items_.pop_front();
      ++dropped_;
      trace::dropped(name_);
    }
    items_.push_back(std::move(value));
    trace::length(name_, items_.size());
    lock.unlock();
    available_.notify_one();
    return true;
  }

  /// Waits for an entry. @return nullopt once stopped, or closed and empty.
  std::optional<T> pop(std::stop_token stop = {}) {
    std::unique_lock lock(mutex_);
    const auto is_over = [&] { return !items_.empty() || closed_; };
    trace::wait(trace::Kind::kEmpty, name_, is_over, [&] { available_.wait(lock, stop, is_over); });
    if (items_.empty() || stop.stop_requested()) return std::nullopt;
    return take_front(lock);
  }

  /// The same, but no longer than until then. @return nullopt also if nothing came.
  std::optional<T> pop_until(std::chrono::steady_clock::time_point until,
                             std::stop_token stop = {}) {
    std::unique_lock lock(mutex_);
    const auto is_over = [&] { return !items_.empty() || closed_; };
    trace::wait(trace::Kind::kEmpty, name_, is_over,
                [&] { available_.wait_until(lock, stop, until, is_over); });
    if (items_.empty() || stop.stop_requested()) return std::nullopt;
    return take_front(lock);
  }

  /// @return nullopt if there is nothing to take right now.
  std::optional<T> try_pop() {
    std::unique_lock lock(mutex_);
    if (items_.empty()) return std::nullopt;
    return take_front(lock);
  }

  /// No more pushes; pops drain what is left.
  void close() {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
    }
    available_.notify_all();
    room_.notify_all();
  }

  [[nodiscard]] bool is_closed() const {
    const std::lock_guard lock(mutex_);
    return closed_;
  }
  /// Closed, and nothing is left to pop: pop_until() that came back with nothing may have met a
  /// push and close() since.
  [[nodiscard]] bool is_drained() const {
    const std::lock_guard lock(mutex_);
    return closed_ && items_.empty();
  }
  [[nodiscard]] std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return items_.size();
  }
  [[nodiscard]] std::size_t dropped() const {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  std::optional<T> take_front(std::unique_lock<std::mutex>& lock) {
    std::optional<T> value(std::move(items_.front()));
    items_.pop_front();
    trace::length(name_, items_.size());
    lock.unlock();
    room_.notify_one();
    return value;
  }

  const std::size_t capacity_;
  const Overflow overflow_;
  const char* const name_;
  mutable std::mutex mutex_;
  std::condition_variable_any available_;
  std::condition_variable_any room_;
  std::deque<T> items_;
  std::size_t dropped_ = 0;
  bool closed_ = false;
};

}  // namespace ygslam
