// Features that are not looked for anew but go on from the frame before: ORB costs about half of a
// frame, and the flow of the motion checks tells already where the points went. A frame of which
// that is done is a followed one; it becomes no keyframe.
#pragma once

#include <optional>

#include "motion/classification/point_classifier.hpp"
#include "tracking/frame_features.hpp"

namespace ygslam {

struct FollowConfig {
  /// In a row, at most; 0: features are looked for in every frame.
  int max_frames = 0;
};

class FeatureFollower {
 public:
  /// @param camera must outlive it.
  FeatureFollower(const FollowConfig& config, const Camera& camera, const PyramidScales& scales)
      : config_(config), camera_(camera), scales_(scales) {}

  struct Input {
    const FramePtr& frame;
    const FrameFlow& flow;
    const PixelMaskPtr& mask;  ///< where there are to be none
  };
  /// As the rows were read, without weights; with the descriptors that the corners had when they
  /// were looked for. @return nullopt: features are to be looked for.
  [[nodiscard]] std::optional<FrameFeatures> step(const Input& in);

  /// Of a frame whose features were looked for.
  void start(const Features& found);
  /// Features of the next frame are to be looked for.
  void renew() { frames_left_ = 0; }

 private:
  /// How many features there are, and in how many cells of the image.
  struct Spread {
    int features = 0, cells = 0;
  };
  [[nodiscard]] Spread spread(const Features& features) const;

  FollowConfig config_;
  const Camera& camera_;
  PyramidScales scales_;
  int frames_left_ = 0;
  Spread found_;  // when features were looked for last
};

}  // namespace ygslam
