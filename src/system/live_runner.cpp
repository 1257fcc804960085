// The stages in threads: the caller's tracks, one segments, one maps. Tracking waits for neither
// (only the very first frame may wait for its mask and frames out of a file for masks that are too
// old, where configured).
#include <atomic>
#include <future>
#include <variant>

#include "core/bounded_queue.hpp"
#include "core/log.hpp"
#include "core/published.hpp"
#include "core/worker_thread.hpp"
#include "system/runner.hpp"
#include "system/segment_worker.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kMapQueue = 64;
constexpr std::size_t kBusyMapper = 1;  // keyframes waiting
constexpr double kSilentAfterS = 2.0;   // of input time without a mask
constexpr double kMaskPatienceS = 1.0;  // a mask that takes longer is not waited for again

struct Focus {
  KeyframeId keyframe;
};
struct MapRequest {
  std::promise<Map> answer;
};
using MapMessage = std::variant<KeyframeMessage, SegmentationPtr, MapPatch, Focus, MapRequest>;

class LiveRunner final : public Runner {
 public:
  LiveRunner(const SlamConfig& config, const Camera& camera, std::unique_ptr<Segmenter> segmenter,
             const MappingStageConfig& mapping)
      : config_(config.run),
        segmenter_(segmenter ? std::make_unique<SegmentWorker>(std::move(segmenter)) : nullptr),
        tracker_(config.tracking, config.orb, config.dynamic, camera, config.run.seed),
        mapping_(mapping, camera, config.orb.levels, config.orb.scale_factor),
        view_(mapping_.view()),
        map_thread_([this](const std::stop_token& stop) { map_loop(stop); },
                    [this] { map_queue_.close(); }) {}

  ~LiveRunner() override {
    map_thread_.request_stop();
    map_queue_.close();
  }

  TrackResult process(const FramePtr& frame) override {
    map_thread_.rethrow();
    if (segmenter_) segmenter_->put_frame(frame);
    std::vector<SegmentationPtr> arrived = arrived_masks(*frame);
    const ScopedTimer timer;
    TrackResult result =
        tracker_.step(frame, view_.load(), arrived, waiting_keyframes_.load() >= kBusyMapper);
    FrameRecord record = make_record(*frame, result);
    if (result.candidate) {
      if (segmenter_) segmenter_->put_keyframe(frame);
      ++waiting_keyframes_;
      urgent_.store(true);
      map_queue_.push(KeyframeMessage{std::move(*result.candidate), result.labels.label});
    }
    if (result.wanted_view) map_queue_.push(Focus{*result.wanted_view});
    record.track_ms = timer.wall_ms();
    record.track_cpu_ms = timer.cpu_ms();
    outcome_.frames.push_back(record);
    return result;
  }

  void correct(MapPatch patch) override { map_queue_.push(std::move(patch)); }

  Map map_copy() override {
    MapRequest request;
    std::future<Map> answer = request.answer.get_future();
    map_queue_.push(std::move(request));
    return answer.get();
  }

  SlamOutcome finish() override {
    const ScopedTimer timer;
    const auto time_left_s = [&] { return config_.finish_patience_s - 1e-3 * timer.wall_ms(); };
    const bool answers = segmenter_ && segmenter_->wait_idle(time_left_s());
    while (answers) {
      const auto masks = segmenter_->try_pop();
      if (!masks) break;
      map_queue_.push(*masks);
    }
    map_queue_.close();
    map_thread_.join();
    map_thread_.rethrow();
    if (answers) segment_waiting(time_left_s);
    take_statistics();
    mapping_.finish();
    return std::move(outcome_);
  }

  const MappingStage& mapping() const override { return mapping_; }

 private:
  std::vector<SegmentationPtr> arrived_masks(const RgbdFrame& frame) {
    std::vector<SegmentationPtr> arrived;
    if (!segmenter_) return arrived;
    if (outcome_.frames.empty()) last_mask_ = frame.stamp;  // silence is counted from here
    wait_for_segmenter(frame.id);
    while (auto masks = segmenter_->try_pop()) arrived.push_back(std::move(*masks));
    if (!arrived.empty()) segmenter_answers_ = true;
    for (const SegmentationPtr& masks : arrived) {
      map_queue_.push(masks);
      last_mask_ = frame.stamp;
    }
    outcome_.statistics.masks_used += static_cast<int>(arrived.size());
    if (!outcome_.statistics.segmenter_silent &&
        seconds_between(frame.stamp, last_mask_) > kSilentAfterS) {
      outcome_.statistics.segmenter_silent = true;
      log::warn("no mask for {:.0f} s: tracking goes on without the segmentation", kSilentAfterS);
    }
    return arrived;
  }

  // A file can wait: without a camera's pace tracking would take the processor from the network.
  // It waits until the segmenter is done with a frame, with or without a mask.
  void wait_for_segmenter(FrameId current) {
    const ScopedTimer timer;
    const auto& frames = outcome_.frames;
    const auto longest = static_cast<std::size_t>(config_.file_mask_lag_frames);
    if (frames.empty()) {
      static_cast<void>(segmenter_->wait_answer(current, config_.first_mask_timeout_s));
    } else if (longest > 0 && frames.size() >= longest && segmenter_answers_) {
      segmenter_answers_ =
          segmenter_->wait_answer(frames[frames.size() - longest].frame, kMaskPatienceS);
    }
    outcome_.statistics.mask_wait_s += 1e-3 * timer.wall_ms();
  }

  // Keyframes whose mask the end of the run overtook: the map can wait for them, for a while.
  template <typename TimeLeft>
  void segment_waiting(const TimeLeft& time_left_s) {
    for (const FramePtr& frame : mapping_.waiting()) {
      segmenter_->put_frame(frame);
      if (!segmenter_->wait_done(time_left_s())) {
        log::warn("segmentation too slow: the last keyframes are mapped without their masks");
        return;
      }
      if (const auto masks = segmenter_->try_pop()) mapping_.apply(**masks);
    }
  }

  void take_statistics() {
    StageStatistics& statistics = outcome_.statistics;
    statistics.map_ms = std::move(map_ms_);
    statistics.map_cpu_ms = std::move(map_cpu_ms_);
    if (!segmenter_) return;
    SegmentWorker::Statistics segment = segmenter_->statistics();
    statistics.segment_ms = std::move(segment.ms);
    statistics.segment_cpu_ms = std::move(segment.cpu_ms);
    statistics.masks_failed = segment.failed;
  }

  void map_loop(const std::stop_token& stop) {
    while (auto message = map_queue_.pop(stop)) {
      std::visit([this](auto& m) { take(m); }, *message);
    }
  }

  void take(KeyframeMessage& message) {
    const ScopedTimer timer;
    mapping_.insert(message);
    view_.store(mapping_.view());
    if (--waiting_keyframes_ == 0) {
      urgent_.store(false);
      mapping_.refine(&urgent_);
      view_.store(mapping_.view());
    }
    map_ms_.push_back(timer.wall_ms());
    map_cpu_ms_.push_back(timer.cpu_ms());
  }
  void take(const SegmentationPtr& masks) {
    if (mapping_.apply(*masks)) view_.store(mapping_.view());
  }
  void take(const MapPatch& patch) {
    mapping_.correct(patch);
    view_.store(mapping_.view());
  }
  void take(const Focus& focus) {
    mapping_.look_around(focus.keyframe);
    view_.store(mapping_.view());
  }
  void take(MapRequest& request) { request.answer.set_value(mapping_.map()); }

  const RunConfig config_;
  std::unique_ptr<SegmentWorker> segmenter_;  // null without one
  Tracker tracker_;
  MappingStage mapping_;  // the map thread's while it runs
  Published<LocalView> view_;
  BoundedQueue<MapMessage> map_queue_{kMapQueue, Overflow::kBlock};
  std::atomic<std::size_t> waiting_keyframes_{0};
  std::atomic<bool> urgent_{false};
  Timestamp last_mask_;                      // when it came
  bool segmenter_answers_ = true;            // not waited for in vain since the last mask
  SlamOutcome outcome_;                      // the caller's
  std::vector<double> map_ms_, map_cpu_ms_;  // the map thread's
  WorkerThread map_thread_;                  // last: it uses everything above
};

}  // namespace

std::unique_ptr<Runner> make_live_runner(const SlamConfig& config, const Camera& camera,
                                         std::unique_ptr<Segmenter> segmenter,
                                         std::vector<int> movable_classes) {
  const MappingStageConfig mapping{config.mapping, config.dense, std::move(movable_classes),
                                   segmenter != nullptr};
  return std::make_unique<LiveRunner>(config, camera, std::move(segmenter), mapping);
}

}  // namespace ygslam
