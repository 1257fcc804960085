// What comes beside the frames of a stream, by the frame that it came before.
#pragma once

#include <deque>
#include <mutex>
#include <utility>
#include <vector>

#include "core/ids.hpp"

namespace ygslam {

/// One thread calls add() and hand_out(); any thread may take(). Of more than are kept the oldest
/// go.
template <typename Sample>
class FrameShares {
 public:
  static constexpr std::size_t kMostWaiting = 100'000;  ///< that nobody has taken: minutes

  void add(Sample sample) { push(newest_, std::move(sample)); }
  /// What was added by now belongs to this frame, however late somebody asks.
  void hand_out(FrameId id) {
    const std::scoped_lock lock(mutex_);
    for (Sample& sample : newest_) push(handed_out_, {id, std::move(sample)});
    newest_.clear();
  }
  /// Of this frame and those before it, what was not taken yet.
  [[nodiscard]] std::vector<Sample> take(FrameId id) {
    std::vector<Sample> taken;
    const std::scoped_lock lock(mutex_);
    for (; !handed_out_.empty() && handed_out_.front().first <= id; handed_out_.pop_front())
      taken.push_back(std::move(handed_out_.front().second));
    return taken;
  }

 private:
  template <typename T>
  static void push(std::deque<T>& waiting, T item) {
    waiting.push_back(std::move(item));
    if (waiting.size() > kMostWaiting) waiting.pop_front();
  }

  std::deque<Sample> newest_;  // since the last frame
  std::mutex mutex_;
  std::deque<std::pair<FrameId, Sample>> handed_out_;
};

}  // namespace ygslam
