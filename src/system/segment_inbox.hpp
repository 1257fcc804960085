// What the segmentation thread works on next: keyframes first, then the newest frame.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>

#include "core/trace.hpp"
#include "image/rgbd_frame.hpp"

namespace ygslam {

class SegmentInbox {
 public:
  /// Never blocks; replaces a frame that was not taken yet.
  void put_frame(FramePtr frame) {
    {
      const std::lock_guard lock(mutex_);
      if (newest_) trace::dropped(kName, newest_->id);
      newest_ = std::move(frame);
      tell_length();
    }
    available_.notify_one();
  }
  /// Never blocks; the oldest of more than kMaxKeyframes waiting ones is let go (it is offered
  /// again at the end of the run).
  void put_keyframe(FramePtr frame) {
    {
      const std::lock_guard lock(mutex_);
      if (last_taken_ != kNoFrame && last_taken_ == frame->id) return;
      keyframes_.push_back(std::move(frame));
      if (keyframes_.size() > kMaxKeyframes) keyframes_.pop_front();
      tell_length();
    }
    available_.notify_one();
  }
  /// @return nullptr once stopped.
  FramePtr take(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    const auto is_over = [&] { return newest_ != nullptr || !keyframes_.empty(); };
    trace::wait(trace::Kind::kEmpty, kName, is_over, [&] { available_.wait(lock, stop, is_over); });
    if (stop.stop_requested()) return nullptr;
    FramePtr frame;
    if (!keyframes_.empty()) {
      frame = std::move(keyframes_.front());
      keyframes_.pop_front();
      if (newest_ && newest_->id == frame->id) newest_ = nullptr;
    } else {
      frame = std::move(newest_);
      newest_ = nullptr;
    }
    tell_length();
    last_taken_ = frame->id;
    in_work_ = true;
    return frame;
  }
  /// The frame taken last is finished.
  void done() {
    {
      const std::lock_guard lock(mutex_);
      in_work_ = false;
      // A keyframe may be done after a later frame.
      if (newest_done_ == kNoFrame || last_taken_ > newest_done_) newest_done_ = last_taken_;
    }
    finished_.notify_all();
  }
  /// Waits until a frame not older than `oldest` is done. @return false if none was in time.
  bool wait_answer(FrameId oldest, double seconds) {
    std::unique_lock lock(mutex_);
    const auto is_over = [&] { return newest_done_ != kNoFrame && newest_done_ >= oldest; };
    bool is_in_time = false;
    trace::wait(trace::Kind::kWait, "the mask", is_over, [&] {
      is_in_time = finished_.wait_for(lock, std::chrono::duration<double>(seconds), is_over);
    });
    return is_in_time;
  }
  /// Forgets the frames nobody took yet. @return false if the one in work is not done in time.
  bool wait_idle(double seconds) {
    std::unique_lock lock(mutex_);
    newest_ = nullptr;
    keyframes_.clear();
    return wait(lock, seconds);
  }
  /// @return false if not all frames were taken and done in time.
  bool wait_done(double seconds) {
    std::unique_lock lock(mutex_);
    return wait(lock, seconds);
  }

 private:
  bool wait(std::unique_lock<std::mutex>& lock, double seconds) {
    return finished_.wait_for(lock, std::chrono::duration<double>(seconds),
                              [&] { return !in_work_ && !newest_ && keyframes_.empty(); });
  }
  void tell_length() const { trace::length(kName, keyframes_.size() + (newest_ ? 1 : 0)); }

  static constexpr std::size_t kMaxKeyframes = 4;
  static constexpr const char* kName = "segmentation";  // in traces
  std::mutex mutex_;
  std::condition_variable_any available_;
  std::condition_variable finished_;
  FramePtr newest_;
  std::deque<FramePtr> keyframes_;
  FrameId last_taken_ = kNoFrame, newest_done_ = kNoFrame;
  bool in_work_ = false;
};

}  // namespace ygslam
