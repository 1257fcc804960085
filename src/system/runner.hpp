// Two ways to drive the same stages: live (threads) and offline (one fixed schedule).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "system/frame_record.hpp"
#include "system/mapping_stage.hpp"
#include "system/slam_config.hpp"

namespace ygslam {

/// What the side stages did, for metrics.
struct StageStatistics {
  std::vector<double> segment_ms, segment_cpu_ms, map_ms, map_cpu_ms;
  int masks_used = 0;
  int masks_failed = 0;
  double mask_wait_s = 0;         ///< tracking stood still for the segmentation
  bool segmenter_silent = false;  ///< no mask came for long while frames did
};

/// Everything a run leaves behind.
struct SlamOutcome {
  std::vector<FrameRecord> frames;
  StageStatistics statistics;
};

class Runner {
 public:
  virtual ~Runner() = default;
  /// Frames in order of their stamps. @return the frame's result at once. Throws what a side stage
  /// ended with, if it was an exception, as finish() does.
  virtual TrackResult process(const FramePtr& frame) = 0;
  /// Takes over what was computed on a copy of the map (loops, welds); tracking goes on in the
  /// corrected world with the next view.
  virtual void correct(MapPatch patch) = 0;
  /// A copy of the map as it is now; features and depths are shared, not copied.
  [[nodiscard]] virtual Map map_copy() = 0;
  /// No more frames: lets the side stages end. process() must not be called after.
  virtual SlamOutcome finish() = 0;
  /// Valid after finish().
  [[nodiscard]] virtual const MappingStage& mapping() const = 0;
};

/// @param segmenter null in modes without one.
[[nodiscard]] std::unique_ptr<Runner> make_live_runner(const SlamConfig& config,
                                                       const Camera& camera,
                                                       std::unique_ptr<Segmenter> segmenter,
                                                       std::vector<int> movable_classes);
[[nodiscard]] std::unique_ptr<Runner> make_offline_runner(const SlamConfig& config,
                                                          const Camera& camera,
                                                          std::unique_ptr<Segmenter> segmenter,
                                                          std::vector<int> movable_classes);

}  // namespace ygslam
