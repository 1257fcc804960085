// Frames on their way from a reader to its consumer, and what became of those that nobody sees.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>

#include "image/rgbd_frame.hpp"

namespace ygslam {

/// A pair that was offered.
struct OfferedFrame {
  FrameId id = kNoFrame;
  Timestamp stamp;
  FramePtr frame = nullptr;   ///< null: its images cannot be used, or it was dropped
  bool is_dropped = false;    ///< the consumer was late
  bool while_paused = false;  ///< ... because somebody had paused it
};

class FrameQueue {
 public:
  enum class When {
    kFullWaits,  ///< push waits for room
    kFullDrops,  ///< the oldest frame is let go; that there was one stays in the queue
  };
  /// @param capacity of frames; where push waits, also of those that cannot be used.
  FrameQueue(std::size_t capacity, When when) : capacity_(capacity), when_(when) {}

  /// @param is_paused nobody is late then. @return false if the queue is closed.
  bool push(OfferedFrame offered, bool is_paused = false);
  /// Waits for the next one. @return nullopt once stopped, or closed and empty.
  std::optional<OfferedFrame> pop(const std::stop_token& stop);
  /// No more pushes; pops drain what is left.
  void close();
  [[nodiscard]] std::size_t dropped() const;
  [[nodiscard]] bool is_empty() const;

 private:
  void drop_oldest(bool is_paused);

  const std::size_t capacity_;
  const When when_;
  mutable std::mutex mutex_;
  std::condition_variable_any available_, room_;
  std::deque<OfferedFrame> offered_;
  std::size_t frames_ = 0;  // among them
  std::size_t dropped_ = 0;
  bool closed_ = false;
};

}  // namespace ygslam
