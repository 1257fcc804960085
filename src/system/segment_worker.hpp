// The segmentation thread: takes frames from its inbox and leaves masks in a queue. A segmenter
// that never comes back is left behind, never waited for.
#pragma once

#include <memory>

#include "core/bounded_queue.hpp"
#include "core/worker_thread.hpp"
#include "segment/segmenter.hpp"
#include "system/run_log.hpp"
#include "system/segment_inbox.hpp"

namespace ygslam {

class SegmentWorker {
 public:
  explicit SegmentWorker(std::unique_ptr<Segmenter> segmenter);
  ~SegmentWorker();
  SegmentWorker(const SegmentWorker&) = delete;
  SegmentWorker& operator=(const SegmentWorker&) = delete;

  /// See SegmentInbox; neither blocks.
  void put_frame(FramePtr frame) { shared_->inbox.put_frame(std::move(frame)); }
  void put_keyframe(FramePtr frame) { shared_->inbox.put_keyframe(std::move(frame)); }

  /// Finished masks, oldest first.
  [[nodiscard]] std::optional<SegmentationPtr> try_pop() { return shared_->masks.try_pop(); }

  /// See Segmenter; it may change in a run.
  [[nodiscard]] bool in_step() const { return shared_->segmenter->in_step(); }

  /// Waits until a frame not older than `oldest` is finished, with a mask (which is then there to
  /// be popped) or in vain. @return false if none was in time.
  [[nodiscard]] bool wait_answer(FrameId oldest, double seconds) {
    return shared_->inbox.wait_answer(oldest, seconds);
  }

  /// Forgets frames not yet begun and waits for the one in work.
  /// @return false if it was not finished in time.
  [[nodiscard]] bool wait_idle(double seconds) { return shared_->inbox.wait_idle(seconds); }

  /// Waits for all frames put in. @return false if they were not finished in time.
  [[nodiscard]] bool wait_done(double seconds) { return shared_->inbox.wait_done(seconds); }

  struct Statistics {
    StageTimes times;
    int failed = 0;
  };
  [[nodiscard]] Statistics statistics() const;

 private:
  // Owned by the thread as well: it may outlive the worker.
  struct Shared {
    explicit Shared(std::unique_ptr<Segmenter> s) : segmenter(std::move(s)) {}
    std::unique_ptr<Segmenter> segmenter;
    SegmentInbox inbox;
    BoundedQueue<SegmentationPtr> masks{kMaskQueue, Overflow::kDropOldest, "masks"};
    std::mutex mutex;  // of statistics
    Statistics statistics;
  };
  static constexpr std::size_t kMaskQueue = 16;
  static void loop(Shared& shared, const std::stop_token& stop);

  std::shared_ptr<Shared> shared_;
  WorkerThread thread_;
};

}  // namespace ygslam
