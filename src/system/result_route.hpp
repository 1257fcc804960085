// What a tracked frame tells the stages behind tracking: the same for both runners, which only say
// where it goes.
#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "system/dense_offer.hpp"
#include "system/mapping_stage.hpp"

namespace ygslam {

/// The frame becomes part of the map, as a keyframe or of the dense map alone, and waits there for
/// its own mask.
using FrameMessage = std::variant<KeyframeMessage, DenseFrameMessage>;

/// A camera that is lost sees this, or one in a submap that has no place yet.
struct PlaceRequest {
  FeaturesPtr features;
  std::vector<float> static_weight;
  std::optional<KeyframeRelativePose> pose;  ///< in a submap
};
/// What tracking asks of the map: other pixels of a rolling shutter, to forget what an IMU said or
/// what is not of the world, a place, a view around a keyframe.
using MapRequest =
    std::variant<ShutterReport, ImuRetraction, PixelMaskPtr, PlaceRequest, KeyframeId>;

class ResultRoute {
 public:
  /// Frames that are no keyframes are offered where the dense map can take them: with masks, of a
  /// map that may change.
  ResultRoute(const DenseMapConfig& dense, const MappingStageConfig& mapping)
      : offer_(dense.enabled && mapping.expects_masks && !mapping.frozen ? dense.interval_s : 0) {}

  /// Of each frame in turn. Takes a keyframe candidate's content out of the result.
  [[nodiscard]] std::optional<FrameMessage> frame_message(const FramePtr& frame,
                                                          TrackResult& result);
  /// In the order in which they are to be answered, after the frame's message.
  [[nodiscard]] static std::vector<MapRequest> requests(const RgbdFrame& frame,
                                                        const TrackResult& result);

 private:
  DenseOffer offer_;
};

}  // namespace ygslam
