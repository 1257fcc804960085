// The adjustment of the whole map in a thread of its own: one job at a time, a new one replaces it.
#pragma once

#include <atomic>
#include <exception>
#include <future>
#include <memory>
#include <mutex>
#include <optional>

#include "core/worker_thread.hpp"
#include "mapping/full_adjustment.hpp"

namespace ygslam {

class AdjustmentThread {
 public:
  AdjustmentThread(const Camera& camera, const BundleConfig& config)
      : camera_(camera), config_(config) {}
  ~AdjustmentThread() { give_up(); }
  AdjustmentThread(const AdjustmentThread&) = delete;
  AdjustmentThread& operator=(const AdjustmentThread&) = delete;

  /// Gives up a job that still runs: its map is no longer the newest.
  void start(FullAdjustment job);
  void give_up();
  /// A job runs, or its result was not taken yet.
  [[nodiscard]] bool is_pending();
  /// The result, once. Throws what the job, or one that was given up, ended with, if it was an
  /// exception.
  [[nodiscard]] std::optional<MapPatch> take_result();
  /// Waits for the job. @param abort set by another thread or a signal to give it up; may be null.
  void finish(const std::atomic<bool>* abort = nullptr);

 private:
  const Camera& camera_;
  const BundleConfig config_;
  std::atomic<bool> abort_{false};
  std::mutex mutex_;
  std::optional<MapPatch> result_;  // under the mutex
  bool pending_ = false;            // the same
  std::future<void> ended_;
  std::exception_ptr failure_;  // the first of jobs that were given up
  std::unique_ptr<WorkerThread> thread_;
};

}  // namespace ygslam
