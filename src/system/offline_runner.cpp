// One thread, one schedule: masks arrive a fixed number of frames late, a keyframe is mapped before
// the next frame is tracked. Same input, seed and binary: same bytes.
#include <deque>
#include <utility>

#include "core/log.hpp"
#include "core/memory.hpp"
#include "core/trace.hpp"
#include "dense/scene_naming/named_scene.hpp"
#include "system/result_route.hpp"
#include "system/runner.hpp"
#include "system/segment_safely.hpp"

namespace ygslam {
namespace {

class OfflineRunner final : public Runner {
 public:
  OfflineRunner(const SlamConfig& config, const Camera& camera,
                std::unique_ptr<Segmenter> segmenter, MapUse map_use)
      : config_(config),
        mapping_config_(mapping_config(config, segmenter != nullptr, map_use.frozen)),
        map_use_(std::move(map_use)),
        camera_(camera),
        log_(config.run.keep_trajectory, config.run.shutter_source),
        inertial_(config.imu, config.wheels),
        segmenter_(std::move(segmenter)) {
    reset();
  }

  TrackResult process(const FramePtr& frame) override {
    const ScopedTimer mask_timer;
    segment(frame);
    const double mask_ms = mask_timer.wall_ms();
    const std::vector<SegmentationPtr> arrived = due(frame->id);
    if (std::exchange(map_corrected_, false)) view_ = mapping_->view();
    const ScopedTimer timer;
    TrackResult result = tracker_->step(tracker_->look(frame, inertial_.predict(frame->stamp)),
                                        view_, arrived, false);
    result.doubt = drift_.step(frame->stamp, result, *view_);
    const auto turn = inertial_.take(frame->stamp, result);
    log_.add(make_record(*frame, result, {timer.wall_ms(), timer.cpu_ms(), mask_ms}, turn), result);
    map_frame(frame, arrived, result);
    return result;
  }

  void expect_motion(const SE3& T_now_last) override { tracker_->expect_motion(T_now_last); }
  void add(const ImuSample& sample) override { inertial_.add(sample); }
  void add(const OdometrySample& sample) override { inertial_.add(sample); }
  void miss(Timestamp stamp) override { log_.miss(stamp); }
  void add_sink(FrameSink sink) override { log_.add_sink(std::move(sink)); }

  void correct(MapPatch patch) override {
    mapping_->correct(patch);
    map_corrected_ = true;
  }

  Map map() override { return mapping_->map(); }
  std::vector<ColouredPoint> cloud() override { return dense_->cloud(); }
  StaticScene scene() override { return named_scene(*dense_); }
  void inspect_dense(const std::function<void(DenseMap&)>& look) override {
    dense_->expect_looks();
    look(*dense_);
  }
  std::vector<LoopAttempt> loop_attempts() override { return mapping_->loop_attempts(); }
  int closed_loops() const override { return mapping_->closed_loops(); }

  void reset() override {
    log_.clear();
    pending_.clear();
    tracker_.emplace(tracker_config(config_, map_use_), config_.orb, config_.dynamic, camera_,
                     config_.run.seed);
    const Map empty({config_.orb.levels, config_.orb.scale_factor});
    mapping_.emplace(mapping_config_, camera_, map_use_.start.value_or(empty));
    dense_.emplace(config_.dense, camera_);
    route_.emplace(config_.dense, mapping_config_);
    inertial_.reset();
    drift_.reset();
    dense_->restore(map_use_.dense);
    view_ = mapping_->view();
    map_changed_ = view_changed_ = map_corrected_ = finished_ = false;
  }

  const SlamOutcome& finish_unless(const std::atomic<bool>* abort) override {
    if (std::exchange(finished_, true)) return log_.outcome();
    inertial_.finish();
    for (const Pending& p : pending_) mapping_->apply(*p.masks);
    pending_.clear();
    // What only frames need makes room for the final map and its mesh.
    segmenter_.reset();
    tracker_.reset();
    give_back_free_memory();
    mapping_->finish(abort);
    dense_->apply(mapping_->take_dense_update());
    dense_->finish();
    log_.finish(mapping_->map(), camera_);
    return log_.outcome();
  }

 private:
  struct Pending {
    std::uint32_t due_frame;
    SegmentationPtr masks;
  };

  void segment(const FramePtr& frame) {
    if (!segmenter_) return;
    const trace::Span span("segment");
    const ScopedTimer timer;
    Result<Segmentation> masks = segment_safely(*segmenter_, *frame);
    log_.statistics().segment.add(timer);
    if (!masks.ok()) {
      if (log_.statistics().masks_failed++ == 0) log::warn("{}", masks.error().message);
      return;
    }
    // The very first mask is there at once, as in a live run that waits for it.
    const std::uint32_t delay = log_.statistics().frames == 0 || segmenter_->in_step()
                                    ? 0U
                                    : static_cast<std::uint32_t>(config_.run.mask_delay_frames);
    pending_.push_back(
        {index(frame->id) + delay, std::make_shared<const Segmentation>(std::move(masks).value())});
  }

  std::vector<SegmentationPtr> due(FrameId now) {
    std::vector<SegmentationPtr> arrived;
    while (!pending_.empty() && pending_.front().due_frame <= index(now)) {
      arrived.push_back(pending_.front().masks);
      pending_.pop_front();
    }
    log_.statistics().masks_used += static_cast<int>(arrived.size());
    return arrived;
  }

  void adjust_all() {
    auto patch = solve(camera_, mapping_->full_adjustment(), mapping_config_.mapper.bundle);
    if (patch) mapping_->correct(*patch);
  }

  template <typename IsWanted>
  void apply(const std::vector<SegmentationPtr>& arrived, const IsWanted& is_wanted) {
    for (const SegmentationPtr& masks : arrived)
      if (is_wanted(*masks)) map_changed_ |= mapping_->apply(*masks);
  }

  void map_frame(const FramePtr& frame, const std::vector<SegmentationPtr>& arrived,
                 TrackResult& result) {
    apply(arrived, [&](const Segmentation& masks) { return masks.frame != frame->id; });
    const trace::Span span("mapping");
    const ScopedTimer timer;
    const bool is_keyframe = result.candidate.has_value();
    const auto take = [this](const auto& message) { this->take(message); };
    if (const auto message = route_->frame_message(frame, result)) std::visit(take, *message);
    // The frame's own mask finds it in the map.
    apply(arrived, [&](const Segmentation& masks) { return masks.frame == frame->id; });
    if (is_keyframe) mapping_->refine();
    if (map_changed_ && mapping_->close_loops()) adjust_all();
    for (const MapRequest& request : ResultRoute::requests(*frame, result))
      std::visit(take, request);
    if (is_keyframe) log_.statistics().map.add(timer);
    publish();
  }

  void take(const KeyframeMessage& message) {
    mapping_->insert(message);
    map_changed_ = true;
  }
  void take(const DenseFrameMessage& message) { mapping_->look_at(message); }
  void take(const ShutterReport& report) {
    mapping_->correct_shutter(report);
    map_changed_ = true;
  }
  void take(const ImuRetraction& retraction) { mapping_->forget_imu(retraction); }
  void take(const PlaceRequest& request) {
    const auto& [features, static_weight, pose] = request;
    if (!pose) {
      view_changed_ |= mapping_->look_for(*features, static_weight);
    } else if (mapping_->look_for(*features, static_weight, *pose)) {
      map_changed_ = true;
      adjust_all();
    }
  }
  void take(const PixelMaskPtr& ego_mask) { map_changed_ |= mapping_->forget_pixels(*ego_mask); }
  void take(KeyframeId focus) {
    mapping_->look_around(focus);
    view_changed_ = true;
  }

  void publish() {
    if (std::exchange(view_changed_, false) || map_changed_) view_ = mapping_->view();
    if (!std::exchange(map_changed_, false) && !mapping_->has_dense_frames()) return;
    dense_->apply(mapping_->take_dense_update());
    while (dense_->step()) {
    }
    if (map_use_.sink) map_use_.sink(mapping_->map());
  }

  const SlamConfig config_;
  const MappingStageConfig mapping_config_;
  const MapUse map_use_;
  const Camera& camera_;
  RunLog log_;
  InertialStage inertial_;
  PoseDrift drift_;
  std::unique_ptr<Segmenter> segmenter_;
  std::optional<Tracker> tracker_;
  std::optional<MappingStage> mapping_;
  std::optional<DenseMap> dense_;
  std::optional<ResultRoute> route_;
  LocalViewPtr view_;
  std::deque<Pending> pending_;
  bool map_changed_ = false;   // in this frame
  bool view_changed_ = false;  // in this frame, with or without the map
  bool finished_ = false;
  bool map_corrected_ = false;
};

}  // namespace

std::unique_ptr<Runner> make_offline_runner(const SlamConfig& config, const Camera& camera,
                                            std::unique_ptr<Segmenter> segmenter, MapUse map_use) {
  return std::make_unique<OfflineRunner>(config, camera, std::move(segmenter), std::move(map_use));
}

}  // namespace ygslam
