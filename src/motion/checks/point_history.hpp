// Where a followed point was some frames ago: held against the camera's motion since then. A motion
// too slow to show between two frames adds up over a dozen.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "geometry/camera.hpp"
#include "motion/checks/ego_motion.hpp"

namespace ygslam {

struct PointHistoryConfig {
  bool enabled = true;
  int spacing_frames = 4;  ///< between the samples of a point
  int min_age_frames = 4;  ///< a younger sample says no more than the flow
  double limit_px = 3.0;   ///< farther from where its sample puts it: the point moves
  double limit_medians =
      4.0;  ///< ... and farther than this many medians of the candidates' residuals
};

/// What the oldest sample of a point says.
struct HistoryResidual {
  EgoMotionResidual px;  ///< against the camera's motion since the sample; negative = not judged
  int age_frames = 0;    ///< of that sample; 0 = none old enough
};

struct HistoryCheck {
  std::vector<HistoryResidual> residual;  ///< per point of the newest frame
  double limit_px = 0;                    ///< beyond, a point moves
};

class PointHistory {
 public:
  explicit PointHistory(const PointHistoryConfig& config) : config_(config) {}

  /// Holds the points of the newest frame, followed into the current one, against the current pose.
  /// @param points followed points, one per feature of the newest frame (their current_px counts).
  /// @param candidate 1 for points whose residuals set the limit.
  [[nodiscard]] HistoryCheck check(const Camera& camera, std::span<const FollowedPoint> points,
                                   std::span<const std::uint8_t> candidate,
                                   const SE3& T_current_newest) const;

  /// The current frame becomes the newest.
  /// @param points its features: previous_px, depth_m and range of this frame.
  /// @param link index of the feature of the frame before that each continues, -1 = none.
  void push(std::span<const FollowedPoint> points, std::span<const std::int32_t> link,
            const SE3& T_camera_odom);
  void clear();

 private:
  static constexpr int kSamples = 4;
  struct Sample {
    std::int32_t frame = -1;  // counts pushes
    Eigen::Vector2f ideal_px = Eigen::Vector2f::Zero();
    float depth_m = 0;
    DepthRange range;
  };
  struct Chain {
    std::array<Sample, kSamples> samples;  // oldest first
    int size = 0;
  };
  struct Pose {
    std::int32_t frame = -1;
    SE3 T_camera_odom;
  };
  [[nodiscard]] const Pose* pose_of(std::int32_t frame) const;
  [[nodiscard]] HistoryResidual residual_of(const Camera& camera, const Chain& chain,
                                            const FollowedPoint& point,
                                            const SE3& T_current_odom) const;

  PointHistoryConfig config_;
  std::vector<Chain> chains_;  // per feature of the newest frame
  std::deque<Pose> poses_;     // of the last frames, oldest first
  std::int32_t newest_ = -1;
};

}  // namespace ygslam
