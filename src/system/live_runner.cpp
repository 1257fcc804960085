// The stages in threads: the caller's tracks, one segments, one maps. Tracking waits for neither
// (only the very first frame may wait for its mask, where configured).
#include <atomic>
#include <thread>
#include <variant>

#include "core/bounded_queue.hpp"
#include "core/log.hpp"
#include "core/published.hpp"
#include "system/runner.hpp"
#include "system/safe_segment.hpp"
#include "system/segment_inbox.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kMaskQueue = 16;
constexpr std::size_t kMapQueue = 64;
constexpr std::size_t kBusyMapper = 1;  // keyframes waiting
constexpr double kSilentAfterS = 2.0;   // of input time without a mask

using MapMessage = std::variant<KeyframeMessage, SegmentationPtr>;

class LiveRunner final : public Runner {
 public:
  LiveRunner(const SlamConfig& config, const Camera& camera, std::unique_ptr<Segmenter> segmenter,
             const MappingStageConfig& mapping)
      : config_(config.run),
        segmenter_(std::move(segmenter)),
        tracker_(config.tracking, config.orb, config.dynamic, camera, config.run.seed),
        mapping_(mapping, camera, config.orb.levels, config.orb.scale_factor),
        view_(mapping_.view()),
        map_thread_([this](const std::stop_token& stop) { map_loop(stop); }) {
    if (segmenter_) {
      segment_thread_ = std::jthread([this](const std::stop_token& stop) { segment_loop(stop); });
    }
  }

  ~LiveRunner() override { stop_threads(); }

  TrackResult process(const FramePtr& frame) override {
    if (segmenter_) inbox_.put_frame(frame);
    std::vector<SegmentationPtr> arrived = arrived_masks(*frame);
    const ScopedTimer timer;
    TrackResult result =
        tracker_.step(frame, view_.load(), arrived, waiting_keyframes_.load() >= kBusyMapper);
    FrameRecord record = make_record(*frame, result);
    if (result.candidate) {
      if (segmenter_) inbox_.put_keyframe(frame);
      ++waiting_keyframes_;
      urgent_.store(true);
      map_queue_.push(KeyframeMessage{std::move(*result.candidate), result.labels.label});
    }
    record.track_ms = timer.wall_ms();
    record.track_cpu_ms = timer.cpu_ms();
    outcome_.frames.push_back(record);
    return result;
  }

  SlamOutcome finish() override {
    if (segment_thread_.joinable()) {
      segment_thread_.request_stop();
      segment_thread_.join();
    }
    while (const auto masks = mask_queue_.try_pop()) map_queue_.push(*masks);
    map_queue_.close();
    map_thread_.join();
    segment_waiting();
    mapping_.finish();
    outcome_.statistics.segment_ms = std::move(segment_ms_);
    outcome_.statistics.segment_cpu_ms = std::move(segment_cpu_ms_);
    outcome_.statistics.map_ms = std::move(map_ms_);
    outcome_.statistics.map_cpu_ms = std::move(map_cpu_ms_);
    outcome_.statistics.masks_failed = masks_failed_;
    return std::move(outcome_);
  }

  const MappingStage& mapping() const override { return mapping_; }

 private:
  std::vector<SegmentationPtr> arrived_masks(const RgbdFrame& frame) {
    std::vector<SegmentationPtr> arrived;
    if (!segmenter_) return arrived;
    if (outcome_.frames.empty()) {
      last_mask_ = frame.stamp;  // silence is counted from here
      if (config_.first_mask_timeout_s > 0) {
        if (auto masks = mask_queue_.pop_for(config_.first_mask_timeout_s)) {
          arrived.push_back(std::move(*masks));
        }
      }
    }
    while (auto masks = mask_queue_.try_pop()) arrived.push_back(std::move(*masks));
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

  void segment_loop(const std::stop_token& stop) {
    while (const FramePtr frame = inbox_.take(stop)) segment(*frame);
  }

  void segment(const RgbdFrame& frame) {
    const ScopedTimer timer;
    Result<Segmentation> masks = segment_safely(*segmenter_, frame);
    segment_ms_.push_back(timer.wall_ms());
    segment_cpu_ms_.push_back(timer.cpu_ms());
    if (masks.ok()) {
      mask_queue_.push(std::make_shared<const Segmentation>(std::move(masks).value()));
    } else if (masks_failed_++ == 0) {
      log::warn("{}", masks.error().message);
    }
  }

  // Keyframes whose mask the end of the run overtook: the map can wait for them.
  void segment_waiting() {
    if (!segmenter_) return;
    for (const FramePtr& frame : mapping_.waiting()) {
      segment(*frame);
      while (const auto masks = mask_queue_.try_pop()) mapping_.apply(**masks);
    }
  }

  void map_loop(const std::stop_token& stop) {
    while (auto message = map_queue_.pop(stop)) {
      const ScopedTimer timer;
      if (const auto* masks = std::get_if<SegmentationPtr>(&*message)) {
        if (mapping_.apply(**masks)) view_.store(mapping_.view());
        continue;
      }
      mapping_.insert(std::get<KeyframeMessage>(*message));
      view_.store(mapping_.view());
      if (--waiting_keyframes_ == 0) {
        urgent_.store(false);
        mapping_.refine(&urgent_);
        view_.store(mapping_.view());
      }
      map_ms_.push_back(timer.wall_ms());
      map_cpu_ms_.push_back(timer.cpu_ms());
    }
  }

  void stop_threads() {
    segment_thread_.request_stop();
    map_thread_.request_stop();
    map_queue_.close();
  }

  const RunConfig config_;
  std::unique_ptr<Segmenter> segmenter_;
  Tracker tracker_;
  MappingStage mapping_;  // the map thread's while it runs
  Published<LocalView> view_;
  SegmentInbox inbox_;
  BoundedQueue<SegmentationPtr> mask_queue_{kMaskQueue, Overflow::kDropOldest};
  BoundedQueue<MapMessage> map_queue_{kMapQueue, Overflow::kBlock};
  std::atomic<std::size_t> waiting_keyframes_{0};
  std::atomic<bool> urgent_{false};
  Timestamp last_mask_;
  SlamOutcome outcome_;                              // the caller's
  std::vector<double> map_ms_, map_cpu_ms_;          // the map thread's
  std::vector<double> segment_ms_, segment_cpu_ms_;  // the segmentation thread's
  int masks_failed_ = 0;
  std::jthread map_thread_;  // last: they use everything above
  std::jthread segment_thread_;
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
