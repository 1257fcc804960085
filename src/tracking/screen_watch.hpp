// What tracking does about screens that play: what is on those it knows is labelled, new ones are
// found with a frame's pose, and where one had moved the camera the pose is to be found without it.
#pragma once

#include <optional>
#include <vector>

#include "tracking/observed_frame.hpp"
#include "tracking/pose_estimator.hpp"
#include "tracking/screen_finder.hpp"

namespace ygslam {

struct ScreenConfig {
  bool enabled = true;
};

class ScreenWatch {
 public:
  /// Of no effect in modes without geometry. @param camera, classifier must outlive it.
  ScreenWatch(const ScreenConfig& config, const Camera& camera, const PyramidScales& scales,
              const NoiseConfig& noise, const PointClassifier& classifier);

  /// The frame before, and where it was.
  struct Before {
    const TrackedFrame& last;
    SE3 T_last_world;
    SE3 T_odom_last;
    const LocalView& view;
  };
  struct Input {
    const ObservedFrame& now;
    const FrameFeatures& seen;  ///< corrected by the velocity that the pose shows
    const PoseResult& pose;
    Before before;
  };
  struct Output {
    /// A new screen: the frame's labels with it, and the pose by the points beside it.
    struct Without {
      ObservedFrame now;
      SE3 T_camera_world;
    };
    std::optional<Without> without;
    bool contested = false;  ///< see PoseResult
  };

  /// What is on a screen that is known, where the camera is about to be.
  [[nodiscard]] ObservedFrame labelled_ahead(ObservedFrame now, const SE3& T_odom_last,
                                             const SE3& T_now_last) const;
  [[nodiscard]] Output step(const Input& in);
  /// The pose in the end: where a screen leaves few points depth has a say.
  [[nodiscard]] SE3 steadied(const PoseResult& pose, const FrameFeatures& seen,
                             const Before& before) const;
  /// A known screen leaves so few points of the map that the pose hangs on the frame before: it
  /// drifts, and a keyframe would hang on nothing.
  [[nodiscard]] bool leave_too_few(const PoseResult& pose) const {
    return !screens_.empty() && pose.landmark_inliers < kFewestOfMap;
  }
  /// The pose by depth alone, where a known screen leaves no points that tell, or others than
  /// depth.
  /// @param pose by the points, if there is one. @param T_guess_world T_camera_world, else.
  [[nodiscard]] std::optional<PoseResult> carried(const std::optional<PoseResult>& pose,
                                                  const SE3& T_guess_world,
                                                  const FrameFeatures& seen,
                                                  const Before& before) const;
  /// With the final pose: what moves on screens that are known keeps them known.
  void follow(const ObservedFrame& now, const SE3& T_odom_camera);
  /// The camera was lost.
  void forget();

 private:
  [[nodiscard]] ObservedFrame labelled(ObservedFrame now, const SE3& T_odom_camera) const;
  [[nodiscard]] std::vector<Vec3> moving(const ObservedFrame& now) const;
  [[nodiscard]] int unexplained_motions(const ObservedFrame& now) const;
  [[nodiscard]] std::vector<ScreenFinder::Point> points_before(const Input& in) const;

  static constexpr int kFewestOfMap = 30;  // landmarks

  bool enabled_;
  const Camera& camera_;
  const PointClassifier& classifier_;
  ScreenFinder finder_;
  KnownScreens screens_;
};

}  // namespace ygslam
