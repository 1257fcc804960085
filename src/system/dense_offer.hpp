// Which frames the dense map is offered beside the keyframes.
#pragma once

#include "tracking/tracker.hpp"

namespace ygslam {

/// What the dense map needs of a frame that is no keyframe.
struct DenseFrameMessage {
  FramePtr frame;
  FeaturesPtr features;
  std::vector<MotionLabel> labels;  ///< per feature
  KeyframeRelativePose pose;
  ReadOut read_out;
};

/// A camera that stands, or goes where keyframes were taken, makes none; what changes before it is
/// to be seen all the same.
class DenseOffer {
 public:
  /// @param interval_s 0: never.
  explicit DenseOffer(double interval_s) : interval_s_(interval_s) {}

  /// Of each frame in turn. @return the frame if it is well placed and none was offered for so
  /// long.
  [[nodiscard]] std::optional<DenseFrameMessage> step(const FramePtr& frame,
                                                      const TrackResult& result) {
    const bool is_due = !last_ || seconds_between(frame->stamp, *last_) >= interval_s_;
    if (result.candidate) last_ = frame->stamp;
    if (interval_s_ <= 0 || result.candidate || !is_due) return std::nullopt;
    if (result.state != TrackState::kTracking || result.provisional) return std::nullopt;
    last_ = frame->stamp;
    return DenseFrameMessage{without_masked_depth(frame, result.masked_pixels), result.features,
                             result.labels.label, result.pose, result.read_out};
  }

 private:
  double interval_s_;
  std::optional<Timestamp> last_;  // of a keyframe or a frame that was offered
};

}  // namespace ygslam
