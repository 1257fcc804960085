// One thread, one schedule: masks arrive a fixed number of frames late, a keyframe is mapped before
// the next frame is tracked. Same input, seed and binary: same bytes.
#include <deque>
#include <utility>

#include "core/log.hpp"
#include "system/runner.hpp"
#include "system/segment_safely.hpp"

namespace ygslam {
namespace {

class OfflineRunner final : public Runner {
 public:
  OfflineRunner(const SlamConfig& config, const Camera& camera,
                std::unique_ptr<Segmenter> segmenter, const MappingStageConfig& mapping)
      : mask_delay_frames_(config.run.mask_delay_frames),
        segmenter_(std::move(segmenter)),
        tracker_(config.tracking, config.orb, config.dynamic, camera, config.run.seed),
        mapping_(mapping, camera, config.orb.levels, config.orb.scale_factor),
        view_(mapping_.view()) {}

  TrackResult process(const FramePtr& frame) override {
    segment(frame);
    const std::vector<SegmentationPtr> arrived = due(frame->id);
    if (std::exchange(map_corrected_, false)) view_ = mapping_.view();
    const ScopedTimer timer;
    TrackResult result = tracker_.step(frame, view_, arrived, false);
    FrameRecord record = make_record(*frame, result);
    record.track_ms = timer.wall_ms();
    record.track_cpu_ms = timer.cpu_ms();
    outcome_.frames.push_back(record);
    for (const SegmentationPtr& masks : arrived) map_changed_ |= mapping_.apply(*masks);
    map(result);
    return result;
  }

  void correct(MapPatch patch) override {
    mapping_.correct(patch);
    map_corrected_ = true;
  }

  Map map_copy() override { return mapping_.map(); }

  SlamOutcome finish() override {
    for (const Pending& p : pending_) mapping_.apply(*p.masks);
    pending_.clear();
    mapping_.finish();
    return std::move(outcome_);
  }

  const MappingStage& mapping() const override { return mapping_; }

 private:
  struct Pending {
    std::uint32_t due_frame;
    SegmentationPtr masks;
  };

  void segment(const FramePtr& frame) {
    if (!segmenter_) return;
    const ScopedTimer timer;
    Result<Segmentation> masks = segment_safely(*segmenter_, *frame);
    outcome_.statistics.segment_ms.push_back(timer.wall_ms());
    outcome_.statistics.segment_cpu_ms.push_back(timer.cpu_ms());
    if (!masks.ok()) {
      if (outcome_.statistics.masks_failed++ == 0) log::warn("{}", masks.error().message);
      return;
    }
    // The very first mask is there at once, as in a live run that waits for it.
    const std::uint32_t delay =
        outcome_.frames.empty() ? 0U : static_cast<std::uint32_t>(mask_delay_frames_);
    pending_.push_back(
        {index(frame->id) + delay, std::make_shared<const Segmentation>(std::move(masks).value())});
  }

  std::vector<SegmentationPtr> due(FrameId now) {
    std::vector<SegmentationPtr> arrived;
    while (!pending_.empty() && pending_.front().due_frame <= index(now)) {
      arrived.push_back(pending_.front().masks);
      pending_.pop_front();
    }
    outcome_.statistics.masks_used += static_cast<int>(arrived.size());
    return arrived;
  }

  void map(TrackResult& result) {
    const bool inserted = result.candidate.has_value();
    const ScopedTimer timer;
    if (inserted) {
      mapping_.insert({std::move(*result.candidate), result.labels.label});
      mapping_.refine();
      outcome_.statistics.map_ms.push_back(timer.wall_ms());
      outcome_.statistics.map_cpu_ms.push_back(timer.cpu_ms());
    }
    if (result.wanted_view) mapping_.look_around(*result.wanted_view);
    if (inserted || map_changed_ || result.wanted_view) view_ = mapping_.view();
    map_changed_ = false;
  }

  const int mask_delay_frames_;
  std::unique_ptr<Segmenter> segmenter_;
  Tracker tracker_;
  MappingStage mapping_;
  LocalViewPtr view_;
  std::deque<Pending> pending_;
  SlamOutcome outcome_;
  bool map_changed_ = false;
  bool map_corrected_ = false;
};

}  // namespace

std::unique_ptr<Runner> make_offline_runner(const SlamConfig& config, const Camera& camera,
                                            std::unique_ptr<Segmenter> segmenter,
                                            std::vector<int> movable_classes) {
  const MappingStageConfig mapping{config.mapping, config.dense, std::move(movable_classes),
                                   segmenter != nullptr};
  return std::make_unique<OfflineRunner>(config, camera, std::move(segmenter), mapping);
}

}  // namespace ygslam
