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
#include "system/run_log.hpp"
#include "system/runner.hpp"

namespace ygslam {

class MapThread {
 public:
  /// @param sink told about the map after each change; may be empty.
  MapThread(MappingStage stage, const Camera& camera, const BundleConfig& bundle,
            const DenseMapConfig& dense, MapSink sink);
  ~MapThread();

  [[nodiscard]] LocalViewPtr view() const { return view_.load(); }
  /// Keyframes that wait to be inserted.
  [[nodiscard]] std::size_t waiting_keyframes() const { return waiting_keyframes_.load(); }
  void insert(KeyframeMessage message);
  void look_at(DenseFrameMessage message) { queue_.push(std::move(message)); }
  void apply(SegmentationPtr masks) { queue_.push(std::move(masks)); }
  void correct(MapPatch patch) { queue_.push(std::move(patch)); }
  void correct_shutter(const ShutterReport& report) { queue_.push(report); }
  void look_around(KeyframeId focus) { queue_.push(focus); }
  /// What a lost camera sees, or one in a submap without a place; passed over while an earlier one
  /// waits.
  struct LostView {
    FeaturesPtr features;
    std::vector<float> static_weight;
    std::optional<KeyframeRelativePose> pose;  ///< in a submap
  };
  void look_for(LostView lost);
  /// Calls `look` with the stage between two messages and waits for it; after join() at once.
  void inspect(const std::function<void(const MappingStage&)>& look);

  /// Throws what the thread ended with, if it was an exception.
  void rethrow() const { thread_.rethrow(); }
  /// Works off what has come and ends the thread.
  void join();
  /// After join().
  [[nodiscard]] MappingStage& stage() { return stage_; }
  /// After join(), with the stage's last changes.
  void finish_dense();
  void inspect_dense(const std::function<void(DenseMap&)>& look) { dense_.inspect(look); }
  [[nodiscard]] const StageTimes& times() const { return times_; }

 private:
  struct Inspection {
    const std::function<void(const MappingStage&)>* look = nullptr;
    std::promise<void> done;
  };
  using Message = std::variant<KeyframeMessage, DenseFrameMessage, SegmentationPtr, MapPatch,
                               ShutterReport, KeyframeId, LostView, Inspection>;
  static constexpr std::size_t kQueue = 64;

  void loop(const std::stop_token& stop);
  void take(const KeyframeMessage& message);
  void take(const DenseFrameMessage& message) { stage_.look_at(message); }
  void take(const SegmentationPtr& masks);
  void take(const MapPatch& patch);
  void take(const ShutterReport& report);
  void take(KeyframeId focus);
  void take(const LostView& lost);
  void take(Inspection& inspection);
  void publish();
  bool close_loops();
  void take_adjustment();

  MappingStage stage_;  // the thread's while it runs
  StageTimes times_;    // the thread's while it runs
  Published<LocalView> view_;
  BoundedQueue<Message> queue_{kQueue, Overflow::kBlock};
  std::atomic<std::size_t> waiting_keyframes_{0};
  std::atomic<bool> urgent_{false};  // a keyframe waits: adjustments end early
  std::atomic<bool> lost_view_waits_{false};
  MapSink sink_;
  AdjustmentThread adjustment_;  // of the whole map, after loops
  DenseThread dense_;
  WorkerThread thread_;  // last: it uses everything above
};

}  // namespace ygslam
