// Two ways to drive the same stages: live (threads) and offline (one fixed schedule).
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "system/dense_sink.hpp"
#include "system/inertial_stage.hpp"
#include "system/mapping_stage.hpp"
#include "system/pose_drift.hpp"
#include "system/run_log.hpp"
#include "system/slam_config.hpp"

namespace ygslam {

/// One thread at a time may call it. Nothing in it grows with time but the map and the trajectory.
class Runner {
 public:
  virtual ~Runner() = default;
  /// Frames in order of their stamps, their ids ascending. @return the frame's result at once.
  /// Throws what a side stage ended with, if it was an exception, as the other calls do.
  virtual TrackResult process(const FramePtr& frame) = 0;

  /// How the camera moved between the last frame and the next, by whoever measures it: a start for
  /// the search, no more (Tracker::expect_motion()).
  virtual void expect_motion(const SE3& T_now_last) = 0;
  /// A reading of SlamConfig::imu; those until a frame's stamp before that frame, as far as they
  /// are there. Without such an IMU they are passed over.
  virtual void add(const ImuSample& sample) = 0;
  /// The same of SlamConfig::wheels.
  virtual void add(const OdometrySample& sample) = 0;
  /// In place of process(): a frame that was offered, but cannot be processed.
  virtual void miss(Timestamp stamp) = 0;
  /// Is told about every processed frame from now on; also after reset().
  virtual void add_sink(FrameSink sink) = 0;
  /// A copy of the map as it is now; features and depths are shared, not copied.
  [[nodiscard]] virtual Map map() = 0;
  /// The coloured static points of the keyframes so far.
  [[nodiscard]] virtual std::vector<ColouredPoint> cloud() = 0;
  /// The static scene as far as it has been fused.
  [[nodiscard]] virtual StaticScene scene() = 0;
  /// What keyframes were compared with to close loops: the first of the run, up to a bound.
  [[nodiscard]] virtual std::vector<LoopAttempt> loop_attempts() = 0;
  /// How often the map was corrected by a place seen again, so far; waits for nobody.
  [[nodiscard]] virtual int closed_loops() const = 0;
  /// Takes over what was computed on a copy of the map (loops, fused landmarks); tracking goes on
  /// in the corrected world with the next view.
  virtual void correct(MapPatch patch) = 0;
  /// Forgets map, trajectory and objects; the next frame starts a new world.
  virtual void reset() = 0;

  /// No more frames: lets the side stages end. process(), correct() and reset() must not be called
  /// after; everything else may, and finish() again.
  const SlamOutcome& finish() { return finish_unless(nullptr); }
  /// @param abort set by another thread or a signal, whenever: adjustments of the whole map that
  /// are still to be solved are given up. Null: nobody sets it.
  virtual const SlamOutcome& finish_unless(const std::atomic<bool>* abort) = 0;

  /// Calls `look` with the dense map while nobody changes it.
  virtual void inspect_dense(const std::function<void(DenseMap&)>& look) = 0;
};

/// Called with the map by the thread that maps, after it changed; what is slow is for another.
using MapSink = std::function<void(const Map&)>;

/// What a run starts from and what becomes of its map.
struct MapUse {
  std::optional<Map> start;           ///< goes on with it; reset() comes back to it
  bool frozen = false;                ///< the map stays as it is: frames are only placed in it
  MapSink sink;                       ///< may be empty
  std::vector<SavedView> dense = {};  ///< of the start's keyframes
  DenseSink dense_sink = {};          ///< of a live run alone
};

[[nodiscard]] inline TrackerConfig tracker_config(const SlamConfig& config, const MapUse& use) {
  TrackerConfig tracking = config.tracking;
  tracking.proposes_keyframes = !use.frozen;
  return tracking;
}

/// @param config resolved (slam_config.hpp). @param segmenter null in modes without one.
[[nodiscard]] std::unique_ptr<Runner> make_live_runner(const SlamConfig& config,
                                                       const Camera& camera,
                                                       std::unique_ptr<Segmenter> segmenter,
                                                       MapUse map_use = {});
[[nodiscard]] std::unique_ptr<Runner> make_offline_runner(const SlamConfig& config,
                                                          const Camera& camera,
                                                          std::unique_ptr<Segmenter> segmenter,
                                                          MapUse map_use = {});

}  // namespace ygslam
