// Follows the points of the previous frame into the current one and says what is known of each.
#pragma once

#include <optional>
#include <vector>

#include "geometry/camera.hpp"
#include "geometry/epipolar.hpp"
#include "geometry/rolling_shutter.hpp"
#include "image/depth.hpp"
#include "motion/flow/lk_flow.hpp"

namespace ygslam {

/// How the camera is expected to have moved since the previous frame.
struct FlowPrediction {
  SE3 T_current_previous;
  ReadOut read_out{};  ///< of the current frame
  /// How much faster it is there if its twist from frame to frame is larger, see MotionModel.
  double velocity_gain_per_s = 0;

  /// The same with the motion that was measured.
  [[nodiscard]] FlowPrediction corrected(const SE3& T_measured) const {
    const Vec6 surplus = T_current_previous.log() - T_measured.log();
    const Vec6 body_velocity = read_out.body_velocity + velocity_gain_per_s * surplus;
    return {T_measured, {read_out.times, body_velocity}, velocity_gain_per_s};
  }
};

/// What is kept of a frame for the next one.
struct FlowFrame {
  ImagePyramid pyramid;
  FeaturesPtr features;
  std::vector<DepthRange> range;            ///< of the depths around each feature
  std::vector<MotionLabel> label;           ///< final label of each feature
  std::vector<std::uint8_t> in_free_space;  ///< of each feature, see PointEvidence
  std::vector<std::uint8_t> rests;          ///< of each feature: on an object that stands still
};

/// A followed point with its depth.
struct FollowedPoint {
  Vec2 previous_px = Vec2::Zero();  ///< ideal
  Vec2 current_px = Vec2::Zero();   ///< ideal
  double depth_m = 0;               ///< in the previous frame; 0 = none: takes no part in the fit
  DepthRange range;                 ///< around it in the previous frame
};

/// Points of the previous frame in the current one: its features, or corners of their own.
struct Followed {
  std::vector<FlowEnd> ends;
  std::vector<PointPair> pairs;  ///< ideal pixels of the middle instants; not finite = not followed
  std::vector<FollowedPoint> points;  ///< the same with depth
  std::vector<MotionLabel> label;     ///< in the previous frame
  [[nodiscard]] std::size_t size() const { return ends.size(); }
};

/// Depths around every feature, wide enough to reach over the misalignment of depth and colour.
[[nodiscard]] std::vector<DepthRange> depth_ranges(const Features& features,
                                                   const DepthImage& depth_m);

/// @param predicted nullopt: points are searched from where they were.
[[nodiscard]] Followed follow_features(const Camera& camera, const FlowFrame& previous,
                                       const ImagePyramid& current,
                                       const std::optional<FlowPrediction>& predicted,
                                       const FlowConfig& config);

/// The points again, with the ends moved to the middle instant of a camera that moves otherwise
/// than predicted.
[[nodiscard]] Followed with_motion(const Camera& camera, Followed followed,
                                   const FlowPrediction& motion);

/// The same for Harris corners of the previous image. A corner has the label and the depth of the
/// feature within link_radius_px, if there is one.
[[nodiscard]] Followed follow_harris(const Camera& camera, const FlowFrame& previous,
                                     const ImagePyramid& current, double link_radius_px,
                                     const FlowConfig& config);

}  // namespace ygslam
