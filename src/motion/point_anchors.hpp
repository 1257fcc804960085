// Where a followed point was some frames ago: held against the camera's motion since then. A motion
// too slow to show between two frames adds up over a dozen.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "geometry/camera.hpp"
#include "motion/rigid_flow.hpp"

namespace ygslam {

struct AnchorConfig {
  bool enabled = true;
  int spacing_frames = 4;      ///< between the anchors of a point
  int min_age_frames = 4;      ///< a younger anchor says no more than the flow
  double limit_px = 3.0;       ///< farther from where its anchor puts it: the point moves
  double limit_medians = 4.0;  ///< ... and farther than this many medians of the voters' residuals
};

/// What the oldest anchor of a point says.
struct AnchorResidual {
  RigidResidual px;    ///< against the camera's motion since the anchor; negative = not judged
  int age_frames = 0;  ///< of that anchor; 0 = none old enough
};

struct AnchorJudgement {
  std::vector<AnchorResidual> residual;  ///< per point of the newest frame
  double limit_px = 0;                   ///< beyond, a point moves
};

class PointAnchors {
 public:
  explicit PointAnchors(const AnchorConfig& config) : config_(config) {}

  /// Holds the points of the newest frame, followed into the current one, against the current pose.
  /// @param points followed points, one per feature of the newest frame (their current_px counts).
  /// @param voter 1 for points whose residuals set the limit.
  [[nodiscard]] AnchorJudgement judge(const Camera& camera, std::span<const RigidPoint> points,
                                      std::span<const std::uint8_t> voter,
                                      const SE3& T_current_newest) const;

  /// The current frame becomes the newest.
  /// @param points its features: previous_px, depth_m and range of this frame.
  /// @param link index of the feature of the frame before that each continues, -1 = none.
  void push(std::span<const RigidPoint> points, std::span<const std::int32_t> link);
  /// Pose of the newest frame in the odometry frame, as soon as it is known. Frames that never get
  /// one hold no anchors.
  void set_pose(const SE3& T_camera_odom);
  void clear();

 private:
  static constexpr int kAnchors = 4;
  struct Anchor {
    std::int32_t frame = -1;  // counts pushes
    Eigen::Vector2f ideal_px = Eigen::Vector2f::Zero();
    float depth_m = 0;
    DepthRange range;
  };
  struct Chain {
    std::array<Anchor, kAnchors> anchors;  // oldest first
    int size = 0;
  };
  struct Pose {
    std::int32_t frame = -1;
    bool known = false;
    SE3 T_camera_odom;
  };
  [[nodiscard]] const Pose* pose_of(std::int32_t frame) const;
  [[nodiscard]] AnchorResidual judge_one(const Camera& camera, const Chain& chain,
                                         const RigidPoint& point, const SE3& T_current_odom) const;

  AnchorConfig config_;
  std::vector<Chain> chains_;  // per feature of the newest frame
  std::deque<Pose> poses_;     // of the last frames, oldest first
  std::int32_t newest_ = -1;
};

}  // namespace ygslam
