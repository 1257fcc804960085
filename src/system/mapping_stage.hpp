// Mapping and the dense cloud as one stage: takes keyframe candidates and masks, publishes views.
#pragma once

#include <atomic>
#include <map>
#include <vector>

#include "dense/static_cloud.hpp"
#include "mapping/mapper.hpp"
#include "motion/masks/mask_labels.hpp"
#include "segment/segmenter.hpp"

namespace ygslam {

/// A keyframe candidate with what the tracker knew of its points' motion.
struct KeyframeMessage {
  KeyframeCandidate candidate;
  std::vector<MotionLabel> labels;  ///< per feature
};

struct MappingStageConfig {
  MapperConfig mapper;
  StaticCloudConfig dense;
  MaskConfig mask;  ///< as tracking reads masks
  bool expects_masks =
      false;  ///< a keyframe's pixels wait for its mask before they enter the cloud
  int max_waiting_keyframes = 64;  ///< beyond: the oldest enters with the point labels alone
};

/// Thread-free; one thread at a time may call it.
class MappingStage {
 public:
  MappingStage(const MappingStageConfig& config, const Camera& camera, const PyramidScales& scales);

  /// Quick: the keyframe and its landmarks are in the next view().
  void insert(const KeyframeMessage& message);
  void refine(const std::atomic<bool>* abort = nullptr);
  void correct(const MapPatch& patch) { mapper_.correct(patch); }
  void look_around(KeyframeId focus) { mapper_.look_around(focus); }
  /// The mask of a keyframe that waits for it; of other frames it is ignored.
  /// @return true if the map changed.
  bool apply(const Segmentation& masks);
  /// End of the run: keyframes whose mask never came enter the cloud with their point labels alone.
  void finish();

  [[nodiscard]] LocalViewPtr view() const { return mapper_.view(); }
  [[nodiscard]] const Map& map() const { return mapper_.map(); }
  /// Frames of keyframes that still wait for their mask, oldest first.
  [[nodiscard]] std::vector<FramePtr> waiting() const;
  [[nodiscard]] std::vector<ColouredPoint> cloud() const;

 private:
  struct Waiting {
    KeyframeId keyframe;
    FramePtr frame;
    FeaturesPtr features;
    std::vector<MotionLabel> labels;
  };
  void integrate(const Waiting& waiting, GreyImage dynamic);

  MappingStageConfig config_;
  Mapper mapper_;
  StaticCloud cloud_;
  std::map<FrameId, Waiting> waiting_;
};

/// Adds to the mask the surface around every dynamic point: pixels within radius_px whose depth is
/// within max_depth_ratio of the point's.
void paint_dynamic_points(GreyImage& mask, const DepthImage& depth_m, const Features& features,
                          std::span<const MotionLabel> labels, int radius_px,
                          float max_depth_ratio);

}  // namespace ygslam
