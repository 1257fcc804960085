// The mapping stage in a thread of its own: takes messages, publishes views.
#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <variant>

#include "core/bounded_queue.hpp"
#include "core/published.hpp"
#include "core/worker_thread.hpp"
#include "system/adjustment_thread.hpp"
#include "system/dense_thread.hpp"
#include "system/mapping_stage.hpp"
#include "system/result_route.hpp"
#include "system/run_log.hpp"
#include "system/runner.hpp"

namespace ygslam {

class MapThread {
 public:
  /// @param sink told about the map after each change; may be empty.
  MapThread(MappingStage stage, const Camera& camera, const BundleConfig& bundle,
            const DenseMapConfig& dense, MapSink sink, DenseSink dense_sink = {});
  ~MapThread();

  [[nodiscard]] LocalViewPtr view() const { return view_.load(); }
  [[nodiscard]] int closed_loops() const { return closed_loops_.load(); }
  /// Keyframes that wait to be inserted.
  [[nodiscard]] std::size_t waiting_keyframes() const { return waiting_keyframes_.load(); }
  void put(KeyframeMessage message);
  /// Passed over while an earlier one waits.
  void put(PlaceRequest request);
  /// The dense map does not keep up: it can do without frames that are no keyframes.
  [[nodiscard]] bool is_dense_behind() const { return dense_.is_behind(); }
  /// A frame, a mask, a patch, a report of the shutter, what an IMU takes back, or a keyframe to
  /// make a view around.
  template <typename Other>
  void put(Other message) {
    queue_.push(std::move(message));
  }
  /// Calls `look` with the stage between two messages and waits for it; after join() at once.
  void inspect(const std::function<void(const MappingStage&)>& look);

  /// Throws what the thread ended with, if it was an exception.
  void rethrow() const { thread_.rethrow(); }
  /// Works off what has come and ends the thread. @param abort set to give up an adjustment of the
  /// whole map; may be null.
  void join(const std::atomic<bool>* abort);
  /// After join().
  [[nodiscard]] MappingStage& stage() { return stage_; }
  /// After join(), with the stage's last changes.
  void finish_dense();
  void restore_dense(const std::vector<SavedView>& views) { dense_.restore(views); }
  void inspect_dense(const std::function<void(DenseMap&)>& look) { dense_.inspect(look); }
  [[nodiscard]] const StageTimes& times() const { return times_; }

 private:
  struct Inspection {
    const std::function<void(const MappingStage&)>* look = nullptr;
    std::promise<void> done;
  };
  using Message =
      std::variant<KeyframeMessage, DenseFrameMessage, SegmentationPtr, MapPatch, ShutterReport,
                   ImuRetraction, PixelMaskPtr, KeyframeId, PlaceRequest, Inspection>;
  static constexpr std::size_t kQueue = 64;

  void loop(const std::stop_token& stop);
  void take(const KeyframeMessage& message);
  void take(const DenseFrameMessage& message) { stage_.look_at(message); }
  void take(const SegmentationPtr& masks);
  void take(const MapPatch& patch);
  void take(const ShutterReport& report);
  void take(const ImuRetraction& retraction);
  void take(const PixelMaskPtr& ego_mask);
  void take(KeyframeId focus);
  void take(const PlaceRequest& request);
  void take(Inspection& inspection);
  void publish();
  void tell_dense();
  bool close_loops();
  void take_adjustment();

  MappingStage stage_;  // the thread's while it runs
  StageTimes times_;    // the thread's while it runs
  Published<LocalView> view_;
  BoundedQueue<Message> queue_{kQueue, Overflow::kBlock, "mapping"};
  std::atomic<std::size_t> waiting_keyframes_{0};
  std::atomic<bool> urgent_{false};  // a keyframe waits: adjustments end early
  std::atomic<bool> place_request_waits_{false};
  std::atomic<int> closed_loops_{0};
  MapSink sink_;
  bool owes_dense_ = false;      // the thread's: the dense map had no room for the last changes
  AdjustmentThread adjustment_;  // of the whole map, after loops
  DenseThread dense_;
  WorkerThread thread_;  // last: it uses everything above
};

}  // namespace ygslam
