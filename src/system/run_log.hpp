// What a run leaves behind, in bounded memory but for the trajectory where it is kept.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/histogram.hpp"
#include "system/early_frames.hpp"
#include "system/frame_record.hpp"

namespace ygslam {

struct StageTimes {
  Histogram wall_ms, cpu_ms;
  void add(const ScopedTimer& timer) {
    wall_ms.add(timer.wall_ms());
    cpu_ms.add(timer.cpu_ms());
  }
};

/// A camera may be lost again and again without end.
inline constexpr std::size_t kMostIntervalsTold = 1000;

struct RunStatistics {
  std::uint64_t frames = 0;  ///< processed
  std::uint64_t missed = 0;  ///< that never came here: unreadable, or dropped
  std::uint64_t tracked = 0;
  std::uint64_t coasting = 0;    ///< of the tracked: by an IMU or wheels alone
  std::uint64_t few_static = 0;  ///< frames
  /// First and last frame of each, the first kMostIntervalsTold.
  std::vector<std::pair<Timestamp, Timestamp>> lost_intervals;
  std::uint64_t lost_interval_count = 0;  ///< all of them
  Histogram mask_age_frames, orb_ms, motion_ms, pose_ms;
  StageTimes track, segment, map;
  double ego_mask_share = 0;  ///< of the image, in the last frame; found by itself
  int masks_used = 0;
  int masks_by_fallback = 0;  ///< of those used: see make_fallback_segmenter()
  int masks_failed = 0;
  int dense_skipped = 0;          ///< live: frames that the dense map was too busy for
  double mask_wait_s = 0;         ///< live: tracking waited for masks, in all
  bool segmenter_silent = false;  ///< no mask came for long while frames did
};

struct SlamOutcome {
  Trajectory trajectory;  ///< of the tracked frames, where it is kept
  RevisedPoses revised;   ///< at the end; where no trajectory is kept, only of its first frames
  RunStatistics statistics;
};

class RunLog {
 public:
  /// @param shutter_source who told of the camera's times, for messages.
  explicit RunLog(bool keep_trajectory, std::string shutter_source = {})
      : keep_trajectory_(keep_trajectory), shutter_source_(std::move(shutter_source)) {}
  void add_sink(FrameSink sink) { sinks_.push_back(std::move(sink)); }
  void add(const FrameRecord& record, const TrackResult& result);
  /// A frame that could not be processed. After half a second of them the camera counts as lost.
  void miss(Timestamp stamp);

  [[nodiscard]] RunStatistics& statistics() { return outcome_.statistics; }
  [[nodiscard]] const SlamOutcome& outcome() const { return outcome_; }
  /// At the end: frames of the beginning are placed in the map as it has become.
  void finish(const Map& map, const Camera& camera) {
    if (!outcome_.revised.empty()) return;
    outcome_.revised = early_frames_.revised(map, camera);
    for (const RetrackedPose& frame : retracked_) frame.revise(map, outcome_.revised);
  }
  /// Forgets the run; the sinks stay.
  void clear() {
    outcome_ = {};
    early_frames_ = {};
    retracked_.clear();
    masked_since_.reset();
    mask_told_ = false;
    lost_ = shutter_found_ = false;
    last_processed_.reset();
    first_missed_.reset();
  }

 private:
  void lose(Timestamp first, Timestamp last);
  void tell_of_mask(const FrameRecord& record, const TrackResult& result);

  std::vector<FrameSink> sinks_;
  SlamOutcome outcome_;
  EarlyFrames early_frames_;
  const bool keep_trajectory_;
  const std::string shutter_source_;
  std::deque<RetrackedPose> retracked_;    // where the trajectory is kept
  std::optional<Timestamp> masked_since_;  // that something was found to be fixed to the camera
  PixelMaskPtr told_mask_;                 // that the share is of
  bool mask_told_ = false;
  bool shutter_found_ = false;  // by this run: shutter_source_ tells no more
  bool lost_ = false;           // in the last frame
  std::optional<Timestamp> last_processed_, first_missed_;  // first: since then
};

}  // namespace ygslam
