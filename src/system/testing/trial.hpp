// For tests of the whole system: frames with exact poses and masks, ways to spoil them, a run over
// them, and how far its trajectory lies from the truth. Where the frames come from:
// rendered_recording.hpp, painted_recording.hpp.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "eval/report.hpp"
#include "image/depth.hpp"
#include "segment/movable.hpp"
#include "system/metrics.hpp"
#include "system/run_writer.hpp"
#include "system/runner.hpp"

namespace ygslam::system_test {

struct Recording {
  Camera camera;
  std::vector<FramePtr> frames;
  std::vector<StampedPose> truth;
  std::vector<GreyImage> ids;  ///< mover at each pixel, beside `frames`

  [[nodiscard]] double time_s(std::size_t i) const {
    return seconds_between(frames[i]->stamp, frames.front()->stamp);
  }
  /// Replaces the frames of [from_s, until_s) by spoiled copies.
  void spoil(double from_s, double until_s, const std::function<void(RgbdFrame&)>& change) {
    const Timestamp start = frames.front()->stamp;
    for (FramePtr& frame : frames) {
      const double t_s = seconds_between(frame->stamp, start);
      if (t_s < from_s || t_s >= until_s) continue;
      auto copy = std::make_shared<RgbdFrame>(*frame);
      change(*copy);
      frame = std::move(copy);
    }
  }
};

/// Settings as a session would hand them to the runner, for images of a quarter of the usual size.
inline SlamConfig small_config(DynamicMode mode) {
  SlamConfig config;
  config.dynamic.mode = mode;
  config.orb.features = 600;
  config.run.file_mask_lag_frames = 0;
  return resolved(std::move(config)).value();
}

/// The truth in place of a network: every mover is taken for a person.
class TruthSegmenter final : public Segmenter {
 public:
  explicit TruthSegmenter(const Recording& recording) {
    for (std::size_t i = 0; i < recording.frames.size(); ++i)
      ids_[recording.frames[i]->id] = recording.ids[i];
  }
  [[nodiscard]] Result<Segmentation> segment(const RgbdFrame& frame) override {
    Segmentation masks;
    masks.frame = frame.id;
    masks.stamp = frame.stamp;
    masks.ids = ids_.at(frame.id);
    int highest = 0;
    for (const std::uint8_t id : masks.ids) highest = std::max<int>(highest, id);
    const auto right = static_cast<float>(masks.ids.width());
    const auto bottom = static_cast<float>(masks.ids.height());
    masks.instances.assign(static_cast<std::size_t>(highest), {0, 0.9F, 0, 0, right, bottom});
    return masks;
  }
  [[nodiscard]] std::string precision() const override { return "truth"; }

 private:
  std::map<FrameId, GreyImage> ids_;
};

struct Trial {
  std::unique_ptr<Runner> runner;
  std::vector<TrackResult> results;  ///< as delivered, per frame
  std::vector<FrameRecord> frames;
  SlamOutcome outcome;

  explicit Trial(std::unique_ptr<Runner> made) : runner(std::move(made)) {
    runner->add_sink([recorded = recorded_](const FrameRecord& record, const TrackResult& result) {
      recorded->push_back(record);
      static_cast<void>(result);
    });
  }
  void process(const FramePtr& frame) { results.push_back(runner->process(frame)); }
  void finish() {
    outcome = runner->finish();
    frames = *recorded_;
  }
  [[nodiscard]] Map map() const { return runner->map(); }
  [[nodiscard]] std::vector<StampedPose> trajectory() const {
    return final_trajectory(outcome.trajectory, outcome.revised, map());
  }
  /// Poses as they were delivered.
  [[nodiscard]] std::vector<StampedPose> live_trajectory() const {
    std::vector<StampedPose> poses;
    for (const FrameRecord& frame : frames)
      if (frame.has_pose()) poses.push_back({frame.stamp, frame.T_world_camera_live});
    return poses;
  }
  [[nodiscard]] bool has_pose(std::size_t i) const { return frames[i].has_pose(); }

 private:
  std::shared_ptr<std::vector<FrameRecord>> recorded_ =
      std::make_shared<std::vector<FrameRecord>>();
};

inline Trial run(std::unique_ptr<Runner> runner, const Recording& recording) {
  Trial run(std::move(runner));
  for (const FramePtr& frame : recording.frames) run.process(frame);
  run.finish();
  return run;
}

inline Trial run_offline(const SlamConfig& config, const Recording& recording,
                         std::unique_ptr<Segmenter> segmenter = nullptr) {
  return run(make_offline_runner(config, recording.camera, std::move(segmenter)), recording);
}

inline Trial run_live(const SlamConfig& config, const Recording& recording,
                      std::unique_ptr<Segmenter> segmenter = nullptr) {
  return run(make_live_runner(config, recording.camera, std::move(segmenter)), recording);
}

/// Root mean square position error after SE(3) alignment [m].
inline double ate_rmse_m(const Recording& recording, const std::vector<StampedPose>& estimate) {
  const auto report = evaluate(recording.truth, estimate);
  CHECK(report.ok(), report.error().message.c_str());
  return report->ate_m.rmse;
}

/// Distance from the true position, both counted from the first frame [m].
inline double drift_m(const Recording& recording, const Trial& run, std::size_t i) {
  const SE3 truth = recording.truth[0].T_world_camera.inverse() * recording.truth[i].T_world_camera;
  return (truth.t() - run.results[i].T_world_camera.t()).norm();
}

/// No pose that a robot was given, or that goes into a file, has a NaN.
inline bool all_poses_finite(const Trial& run) {
  const auto finite = [](const StampedPose& p) { return p.T_world_camera.is_finite(); };
  const auto trajectory = run.trajectory();
  const auto live = run.live_trajectory();
  return std::all_of(trajectory.begin(), trajectory.end(), finite) &&
         std::all_of(live.begin(), live.end(), finite);
}

/// Keyframes made of frames in [from_s, until_s).
inline int keyframes_between(const Recording& recording, const Trial& run, double from_s,
                             double until_s) {
  int count = 0;
  for (std::size_t i = 0; i < run.results.size(); ++i) {
    const double t_s = recording.time_s(i);
    count +=
        static_cast<int>(run.results[i].candidate.has_value() && t_s >= from_s && t_s < until_s);
  }
  return count;
}

inline int lost_frames(const Trial& run) {
  return static_cast<int>(std::count_if(run.frames.begin(), run.frames.end(),
                                        [](const auto& f) { return !f.has_pose(); }));
}

}  // namespace ygslam::system_test
