// The stages in threads: the caller's tracks, one segments, one maps. Tracking waits for neither
// (only every frame for its mask where the segmenter is in step, the very first frame, and frames
// out of a file for masks that are too old, where configured; where 64 messages wait for the
// mapper, for the mapper; and who asks for a copy of a map, for that).
#include <deque>
#include <set>

#include "core/log.hpp"
#include "core/memory.hpp"
#include "dense/scene_naming/named_scene.hpp"
#include "system/map_thread.hpp"
#include "system/runner.hpp"
#include "system/segment_worker.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kBusyMapper = 1;  // keyframes waiting
constexpr std::size_t kMostWithoutMask = 256;
constexpr double kSilentAfter_s = 2.0;   // of input time without a mask
constexpr double kMaskPatience_s = 1.0;  // a mask that takes longer is not waited for again

class LiveRunner final : public Runner {
 public:
  LiveRunner(const SlamConfig& config, const Camera& camera, std::unique_ptr<Segmenter> segmenter,
             MapUse map_use)
      : config_(config),
        mapping_config_(mapping_config(config, segmenter != nullptr, map_use.frozen)),
        map_use_(std::move(map_use)),
        camera_(camera),
        log_(config.run.keep_trajectory, config.run.shutter_source),
        inertial_(config.imu, config.wheels),
        segmenter_(segmenter ? std::make_unique<SegmentWorker>(std::move(segmenter)) : nullptr) {
    start();
  }

  TrackResult process(const FramePtr& frame) override {
    map_->rethrow();
    if (segmenter_) segmenter_->put_frame(frame);
    const ScopedTimer timer;
    Tracker::SeenFrame seen =
        tracker_->look(frame, inertial_.predict(frame->stamp));  // while the segmenter works on it
    const ScopedTimer mask_timer;
    const std::vector<SegmentationPtr> arrived = arrived_masks(*frame);
    const double mask_ms = mask_timer.wall_ms();
    const LocalViewPtr view = map_->view();
    TrackResult result =
        tracker_->step(std::move(seen), view, arrived, map_->waiting_keyframes() >= kBusyMapper);
    result.doubt = drift_.step(frame->stamp, result, *view);
    const auto turn = inertial_.take(frame->stamp, result);
    const auto put = [this](auto& message) { map_->put(std::move(message)); };
    if (auto message = route_->frame_message(frame, result)) {
      if (std::holds_alternative<DenseFrameMessage>(*message) && map_->is_dense_behind()) {
        skip_in_dense_map();
      } else {
        await_mask(frame);
        std::visit(put, *message);
      }
    }
    for (MapRequest& request : ResultRoute::requests(*frame, result)) std::visit(put, request);
    for (const SegmentationPtr& masks : arrived) hand_to_mapper(masks);
    const FrameTimes times{timer.wall_ms() - mask_ms, timer.cpu_ms(), mask_ms};
    log_.add(make_record(*frame, result, times, turn), result);
    last_frames_.push_back(frame->id);
    if (last_frames_.size() > std::max<std::size_t>(1, longest_lag())) last_frames_.pop_front();
    return result;
  }

  void expect_motion(const SE3& T_now_last) override { tracker_->expect_motion(T_now_last); }
  void add(const ImuSample& sample) override { inertial_.add(sample); }
  void add(const OdometrySample& sample) override { inertial_.add(sample); }
  void miss(Timestamp stamp) override { log_.miss(stamp); }
  void add_sink(FrameSink sink) override { log_.add_sink(std::move(sink)); }

  Map map() override {
    std::optional<Map> copy;
    map_->inspect([&](const MappingStage& stage) { copy = stage.map(); });
    return std::move(copy).value();
  }

  std::vector<ColouredPoint> cloud() override {
    std::vector<ColouredPoint> points;
    map_->inspect_dense([&](DenseMap& dense) { points = dense.cloud(); });
    return points;
  }

  StaticScene scene() override {
    StaticScene scene;
    map_->inspect_dense([&](DenseMap& dense) { scene = named_scene(dense); });
    return scene;
  }

  void inspect_dense(const std::function<void(DenseMap&)>& look) override {
    map_->inspect_dense(look);
  }

  std::vector<LoopAttempt> loop_attempts() override {
    std::vector<LoopAttempt> attempts;
    map_->inspect([&](const MappingStage& stage) { attempts = stage.loop_attempts(); });
    return attempts;
  }

  int closed_loops() const override { return map_->closed_loops(); }

  void correct(MapPatch patch) override { map_->put(std::move(patch)); }

  void reset() override {
    log_.clear();
    start();
  }

  const SlamOutcome& finish_unless(const std::atomic<bool>* abort) override {
    if (std::exchange(finished_, true)) return log_.outcome();
    inertial_.finish();
    const ScopedTimer timer;
    const auto time_left_s = [&] { return config_.run.finish_patience_s - 1e-3 * timer.wall_ms(); };
    const bool answers = segmenter_ && segmenter_->wait_idle(time_left_s());
    while (answers) {
      const auto masks = segmenter_->try_pop();
      if (!masks) break;
      hand_to_mapper(*masks);
    }
    map_->join(abort);
    if (answers) segment_waiting(time_left_s);
    RunStatistics& statistics = log_.statistics();
    if (segmenter_) {
      statistics.segment = segmenter_->statistics().times;
      statistics.masks_failed = segmenter_->statistics().failed;
    }
    // What only frames need makes room for the final map and its mesh.
    if (answers) segmenter_.reset();
    tracker_.reset();
    give_back_free_memory();
    map_->stage().finish(abort);
    map_->finish_dense();
    statistics.map = map_->times();
    statistics.dense_skipped += map_->stage().dense_skipped();
    log_.finish(map_->stage().map(), camera_);
    return log_.outcome();
  }

 private:
  void start() {
    map_.reset();
    tracker_.emplace(tracker_config(config_, map_use_), config_.orb, config_.dynamic, camera_,
                     config_.run.seed);
    Map empty({config_.orb.levels, config_.orb.scale_factor});
    empty.set_identity(random_identity());
    map_ = std::make_unique<MapThread>(
        MappingStage(mapping_config_, camera_, map_use_.start.value_or(empty)), camera_,
        mapping_config_.mapper.bundle, config_.dense, map_use_.sink, map_use_.dense_sink);
    map_->restore_dense(map_use_.dense);
    route_.emplace(config_.dense, mapping_config_);
    inertial_.reset();
    drift_.reset();
    without_mask_.clear();
    last_frames_.clear();
    last_mask_.reset();
    segmenter_answers_ = true;
  }

  void skip_in_dense_map() {
    if (log_.statistics().dense_skipped++ == 0)
      log::warn("the processor is busy: the dense map goes by keyframes alone for now");
  }

  /// The mask of this frame is for the map, too.
  void await_mask(const FramePtr& frame) {
    if (segmenter_) segmenter_->put_keyframe(frame);
    without_mask_.insert(frame->id);
    if (without_mask_.size() > kMostWithoutMask) without_mask_.erase(without_mask_.begin());
  }

  /// The map has no use for masks of other frames.
  void hand_to_mapper(const SegmentationPtr& masks) {
    if (without_mask_.erase(masks->frame) > 0) map_->put(masks);
  }

  std::vector<SegmentationPtr> arrived_masks(const RgbdFrame& frame) {
    std::vector<SegmentationPtr> arrived;
    if (!segmenter_) return arrived;
    if (!last_mask_) last_mask_ = frame.stamp;  // silence is counted from here
    wait_for_segmenter(frame.id);
    while (auto masks = segmenter_->try_pop()) arrived.push_back(std::move(*masks));
    RunStatistics& statistics = log_.statistics();
    statistics.masks_used += static_cast<int>(arrived.size());
    for (const SegmentationPtr& masks : arrived)
      statistics.masks_by_fallback += masks->by_fallback ? 1 : 0;
    if (!arrived.empty()) {
      segmenter_answers_ = true;
      last_mask_ = frame.stamp;
    }
    if (!statistics.segmenter_silent &&
        seconds_between(frame.stamp, *last_mask_) > kSilentAfter_s) {
      statistics.segmenter_silent = true;
      log::warn("no mask for {:.0f} s: tracking goes on without the segmentation", kSilentAfter_s);
    }
    return arrived;
  }

  [[nodiscard]] std::size_t longest_lag() const {
    return static_cast<std::size_t>(config_.run.file_mask_lag_frames);
  }

  // Waits until the segmenter is done with a frame, with or without a mask: with this one where it
  // is in step, else with one that is not too old where frames come out of a file. A file can wait;
  // without a camera's pace tracking would take the processor from the network.
  void wait_for_segmenter(FrameId current) {
    const ScopedTimer timer;
    if (last_frames_.empty()) {
      static_cast<void>(segmenter_->wait_answer(current, config_.run.first_mask_timeout_s));
    } else if (segmenter_->in_step() && segmenter_answers_) {
      segmenter_answers_ = segmenter_->wait_answer(current, kMaskPatience_s);
    } else if (longest_lag() > 0 && last_frames_.size() >= longest_lag() && segmenter_answers_) {
      segmenter_answers_ = segmenter_->wait_answer(last_frames_.front(), kMaskPatience_s);
    }
    log_.statistics().mask_wait_s += 1e-3 * timer.wall_ms();
  }

  // Keyframes whose mask the end of the run overtook: the map can wait for them, for a while.
  template <typename TimeLeft>
  void segment_waiting(const TimeLeft& time_left_s) {
    for (const FramePtr& frame : map_->stage().waiting()) {
      segmenter_->put_frame(frame);
      if (!segmenter_->wait_done(time_left_s())) {
        log::warn("segmentation too slow: the last keyframes are mapped without their masks");
        return;
      }
      if (const auto masks = segmenter_->try_pop()) map_->stage().apply(**masks);
    }
  }

  const SlamConfig config_;
  const MappingStageConfig mapping_config_;
  const MapUse map_use_;
  const Camera& camera_;
  RunLog log_;
  InertialStage inertial_;
  PoseDrift drift_;
  std::unique_ptr<SegmentWorker> segmenter_;  // null without one
  std::optional<Tracker> tracker_;
  std::unique_ptr<MapThread> map_;
  std::optional<ResultRoute> route_;
  std::set<FrameId> without_mask_;      // frames the map waits for, whose mask has not come
  std::deque<FrameId> last_frames_;     // as many as masks may lag behind
  std::optional<Timestamp> last_mask_;  // when it came
  bool segmenter_answers_ = true;       // not waited for in vain since the last mask
  bool finished_ = false;
};

}  // namespace

std::unique_ptr<Runner> make_live_runner(const SlamConfig& config, const Camera& camera,
                                         std::unique_ptr<Segmenter> segmenter, MapUse map_use) {
  return std::make_unique<LiveRunner>(config, camera, std::move(segmenter), std::move(map_use));
}

}  // namespace ygslam
