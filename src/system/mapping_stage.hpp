// Mapping and loop closing as one stage: takes keyframe candidates and masks, gives views for the
// tracker and updates for the dense map.
#pragma once

#include <atomic>
#include <deque>
#include <map>
#include <vector>

#include "dense/dense_map.hpp"
#include "loop/submap_joiner.hpp"
#include "mapping/full_adjustment.hpp"
#include "mapping/mapper.hpp"
#include "motion/masks/mask_labels.hpp"
#include "segment/segmenter.hpp"
#include "system/dense_offer.hpp"
#include "system/slam_config.hpp"

namespace ygslam {

/// A keyframe candidate with what the tracker knew of its points' motion.
struct KeyframeMessage {
  KeyframeCandidate candidate;
  std::vector<MotionLabel> labels;  ///< per feature; empty: not known
};

struct MappingStageConfig {
  MapperConfig mapper;
  LoopConfig loop;
  bool close_loops = true;
  bool frozen = false;  ///< the map stays as it is: frames are placed in it, nothing is added
  MaskConfig mask;      ///< as tracking reads masks
  bool expects_masks =
      false;  ///< a keyframe's pixels wait for its mask before they enter the dense map
  int max_waiting_keyframes = 64;      ///< beyond: the oldest enters with the point labels alone
  std::size_t max_dense_frames = 128;  ///< that nobody took; beyond: the oldest is let go
  int max_waiting_frames = 8;          ///< that are no keyframes; beyond: the oldest is let go
};

[[nodiscard]] MappingStageConfig mapping_config(const SlamConfig& config, bool expects_masks,
                                                bool frozen);

/// Thread-free; one thread at a time may call it.
class MappingStage {
 public:
  /// @param map to go on with; an empty one to start.
  MappingStage(const MappingStageConfig& config, const Camera& camera, Map map);

  /// Quick: the keyframe and its landmarks are in the next view().
  void insert(const KeyframeMessage& message);
  /// A frame for the dense map alone; it enters with its mask, or not at all.
  void look_at(const DenseFrameMessage& message);
  void refine(const std::atomic<bool>* abort = nullptr);
  /// Looks for the place of the keyframes that are complete since the last call.
  /// @return true if the map changed.
  bool close_loops();
  /// The camera is lost and sees this: the next view is of the place that it shows, if one does.
  /// @return true if there is another view.
  bool look_for(const Features& features, std::span<const float> static_weight);
  /// The camera is in a submap that has no place yet and sees this.
  /// @return true if the map changed: the submap was joined to the rest.
  bool look_for(const Features& features, std::span<const float> static_weight,
                const KeyframeRelativePose& pose);
  /// The whole map as a job for another thread; its patch goes to correct(). Only of a map
  /// that has keyframes.
  [[nodiscard]] FullAdjustment full_adjustment() const {
    return make_full_adjustment(map(), config_.mapper.noise);
  }
  void correct(const MapPatch& patch) { mapper_.correct(patch); }
  /// A read-out time was found when part of the map was made: it is adjusted as a whole.
  void correct_shutter(const ShutterReport& report);
  /// Masked pixels have never been of the world: see Mapper. @return true if the map changed.
  bool forget_pixels(const GreyImage& mask) {
    return !config_.frozen && mapper_.forget_pixels(mask);
  }
  /// An IMU was wrong. @return true if the map knew something by it.
  bool forget_imu(const ImuRetraction& retraction) {
    return !config_.frozen && mapper_.forget_imu(retraction);
  }
  void look_around(KeyframeId focus) { mapper_.look_around(focus); }
  /// The mask of a keyframe, or of a frame for the dense map, that waits for it; of others it is
  /// ignored.
  /// @return true if the map changed.
  bool apply(const Segmentation& masks);
  /// End of the run: keyframes whose mask never came enter the dense map with their point labels
  /// alone, frames that are none do not.
  /// @param abort set to leave the map as it is, unstraightened; may be null.
  void finish(const std::atomic<bool>* abort);

  [[nodiscard]] LocalViewPtr view() const { return mapper_.view(); }
  [[nodiscard]] const Map& map() const { return mapper_.map(); }
  /// Frames that still wait for their mask, those of keyframes first, oldest first.
  [[nodiscard]] std::vector<FramePtr> waiting() const;
  /// Frames that the dense map does not get: it took none for too long.
  [[nodiscard]] int dense_skipped() const { return dense_skipped_; }
  [[nodiscard]] bool has_dense_frames() const { return !dense_update_.added.empty(); }
  /// What changed for the dense map since the last call.
  [[nodiscard]] DenseUpdate take_dense_update();
  /// Loops closed and submaps joined so far.
  [[nodiscard]] int closed_loops() const { return closed_loops_; }
  /// What keyframes were compared with: the first of the run, up to a bound.
  [[nodiscard]] const std::vector<LoopAttempt>& loop_attempts() const { return attempts_; }

 private:
  struct Waiting {
    KeyframeId keyframe;
    FramePtr frame;
    FeaturesPtr features;
    std::vector<MotionLabel> labels;
  };
  struct WaitingFrame {
    KeyframeId newest = kNoKeyframe;
    DenseFrameMessage message;
  };
  /// @param masks of its frame; nullptr: none came.
  void integrate(const Waiting& waiting, const Segmentation* masks);
  void offer(DenseFrame frame);
  /// The keyframe itself, or what a removed one is told by: where a camera is at a pose relative to
  /// it.
  [[nodiscard]] DenseAnchor anchor_of(const KeyframeRelativePose& pose) const;
  void join(const SubmapJoin& join);

  MappingStageConfig config_;
  const Camera& camera_;
  Mapper mapper_;
  PlaceIndex index_;
  PlaceFinder place_finder_;
  LoopCloser loop_closer_;
  SubmapJoiner submap_joiner_;
  std::vector<LoopAttempt> attempts_;
  int closed_loops_ = 0;
  std::deque<KeyframeId> complete_;  // mapped and rid of moving things, not compared yet
  DenseUpdate dense_update_;
  int dense_skipped_ = 0;
  std::vector<KeyframeId> culled_;  // that the dense map was not told of
  std::map<FrameId, WaitingFrame> waiting_frames_;
  std::map<FrameId, Waiting> waiting_;
};

}  // namespace ygslam
