#include "facade/push_thread.hpp"

#include <utility>

namespace ygslam::api {

PushThread::PushThread(Process process, std::function<void(const Result&)> deliver)
    : process_(std::move(process)),
      deliver_(std::move(deliver)),
      thread_([this](const std::stop_token& stop) { loop(stop); }) {}

PushThread::~PushThread() { thread_.request_stop(); }

void PushThread::put(Input input) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_) {
      ++dropped_;
      if (input.T_now_last && waiting_->T_now_last) {
        *input.T_now_last = *input.T_now_last * *waiting_->T_now_last;
      } else {
        input.T_now_last.reset();
      }
    }
    waiting_ = std::move(input);
  }
  came_.notify_one();
}

std::optional<Result> PushThread::poll() {
  const std::lock_guard lock(mutex_);
  if (results_.empty()) return std::nullopt;
  Result result = std::move(results_.front());
  results_.pop_front();
  return result;
}

void PushThread::clear() {
  std::unique_lock lock(mutex_);
  waiting_.reset();
  idle_.wait(lock, [&] { return !is_busy_; });
  results_.clear();
}

void PushThread::finish() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  came_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void PushThread::loop(const std::stop_token& stop) {
  while (const auto input = take(stop)) {
    const struct Busy {
      PushThread& thread;
      ~Busy() { thread.rest(); }
    } busy{*this};
    hand_out(process_(*input));
  }
}

void PushThread::rest() {
  {
    const std::lock_guard lock(mutex_);
    is_busy_ = false;
  }
  idle_.notify_all();
}

std::optional<Input> PushThread::take(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  came_.wait(lock, stop, [&] { return waiting_ || closed_; });
  if (stop.stop_requested()) return std::nullopt;
  is_busy_ = waiting_.has_value();
  return std::exchange(waiting_, std::nullopt);
}

void PushThread::hand_out(Result result) {
  {
    const std::lock_guard lock(mutex_);
    result.dropped_frames = dropped_;
    if (!deliver_) {
      results_.push_back(std::move(result));
      if (results_.size() > kMostResults) results_.pop_front();
      return;
    }
  }
  try {
    deliver_(result);
  } catch (...) {  // the caller's own affair
  }
}

}  // namespace ygslam::api
