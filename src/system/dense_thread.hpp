// The dense map stage in a thread of its own, behind everything else: what waits for it waits for
// nobody.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>

#include "core/bounded_queue.hpp"
#include "core/worker_thread.hpp"
#include "dense/dense_map.hpp"
#include "system/dense_sink.hpp"

namespace ygslam {

class DenseThread {
 public:
  DenseThread(const DenseMapConfig& config, const Camera& camera, DenseSink sink = {});
  ~DenseThread();
  DenseThread(const DenseThread&) = delete;
  DenseThread& operator=(const DenseThread&) = delete;

  /// Whether another update would have to wait.
  [[nodiscard]] bool is_full() const {
    return queue_.size() >= kQueue || frames_waiting_.load() >= kMostFrames;
  }
  /// Whether it does not keep up with what it is told.
  [[nodiscard]] bool is_behind() const {
    return queue_.size() >= kBehind || frames_waiting_.load() >= kManyFrames;
  }
  /// Waits only where it is full. After finish() nothing is taken.
  void apply(DenseUpdate update) {
    const std::size_t frames = update.added.size();
    frames_waiting_ += frames;
    if (!queue_.push(std::move(update))) frames_waiting_ -= frames;
  }
  void restore(const std::vector<SavedView>& views);
  /// Calls `look` with the map, after the step or look that is under way, before any other.
  void inspect(const std::function<void(DenseMap&)>& look);
  /// Works off what has come, brings all up to date and ends the thread. May be called again.
  void finish();

 private:
  void loop(const std::stop_token& stop);
  [[nodiscard]] std::optional<DenseUpdate> next(const std::stop_token& stop);
  void work_off(DenseUpdate update, const std::stop_token& stop);
  [[nodiscard]] bool step();
  [[nodiscard]] std::unique_lock<std::mutex> locked();
  /// The same for the thread itself, when nobody waits for a look: the mutex alone would let it go
  /// on before those who wait.
  [[nodiscard]] std::unique_lock<std::mutex> locked_after_looks();
  void show_if_due(const std::stop_token& stop);

  struct Look {
    std::function<void(DenseMap&)> look;
    double every_s, most_share;  // of the thread's time
    double most_wait_s = std::numeric_limits<double>::infinity();
    bool waits = false;  // the map changed since
    std::chrono::steady_clock::time_point next{};
  };

  static constexpr std::size_t kQueue = 64, kBehind = 8, kManyFrames = 16, kMostFrames = 64;
  std::mutex mutex_;
  std::atomic<int> looks_waiting_{0};           // inspect() that has not got the mutex
  DenseMap map_;                                // under the mutex
  std::atomic<std::size_t> frames_waiting_{0};  // told of, images not packed yet
  std::array<Look, 2> looks_;                   // the thread's; the more urgent one first
  BoundedQueue<DenseUpdate> queue_{kQueue, Overflow::kBlock, "dense map"};
  WorkerThread thread_;  // last: it uses everything above
};

}  // namespace ygslam
