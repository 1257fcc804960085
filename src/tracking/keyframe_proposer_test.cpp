#include "tracking/keyframe_proposer.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

SE3 T_camera_at(double x_m) { return SE3(Mat3::Identity(), Vec3(x_m, 0, 0)).inverse(); }

ViewKeyframe keyframe_at(std::uint32_t id, double x_m) {
  KeyframeData data;
  data.id = KeyframeId(id);
  ViewKeyframe keyframe;
  keyframe.data = std::make_shared<const KeyframeData>(std::move(data));
  keyframe.T_camera_world = T_camera_at(x_m);
  keyframe.tracked_landmarks = 200;
  return keyframe;
}

/// All of its 200 near points are tracked.
TrackedFrame frame_at(double x_m, const LocalView& view) {
  constexpr std::size_t kNearPoints = 200;
  Features features;
  features.points.resize(kNearPoints);
  for (Feature& feature : features.points) feature.depth_m = 1;
  TrackedFrame frame;
  frame.seen.frame = std::make_shared<const RgbdFrame>();
  frame.seen.features = std::make_shared<const Features>(std::move(features));
  frame.seen.static_weight.assign(kNearPoints, 1);
  frame.landmarks.assign(kNearPoints, LandmarkId(1));
  frame.pose = {view.reference().data->id,
                T_camera_at(x_m) * view.reference().T_camera_world.inverse()};
  return frame;
}

TEST(KeyframeProposer, WhereAKeyframeWasTakenNoneIsDue) {
  LocalView view;
  view.keyframes = {keyframe_at(2, 1.0), keyframe_at(1, 0.0)};  // the reference is the first
  KeyframeProposer proposer(KeyframePolicyConfig{}, 100);
  for (int i = 0; i < 1000; ++i) proposer.count_frame();
  PoseResult pose;
  pose.landmark_inliers = 200;
  EXPECT_FALSE(proposer.wants(frame_at(1.0, view), view, pose, false));
  EXPECT_FALSE(proposer.wants(frame_at(0.01, view), view, pose, false)) << "it swayed back";
  EXPECT_TRUE(proposer.wants(frame_at(0.5, view), view, pose, false));
  proposer.restart();
  EXPECT_FALSE(proposer.wants(frame_at(0.5, view), view, pose, false));
}

TEST(KeyframeProposer, WithoutDepthStaticPointsWillDoIfTheMapSaysWhereTheCameraIs) {
  LocalView view;
  view.keyframes = {keyframe_at(1, 0.0)};
  KeyframeProposer proposer(KeyframePolicyConfig{}, 60);
  for (int i = 0; i < 100; ++i) proposer.count_frame();
  TrackedFrame blind = frame_at(0.5, view);
  blind.seen.features = [&] {
    Features features = *blind.seen.features;
    for (Feature& feature : features.points) feature.depth_m = 0;
    return std::make_shared<const Features>(std::move(features));
  }();
  PoseResult pose;
  pose.landmark_inliers = 15;
  EXPECT_TRUE(proposer.wants(blind, view, pose, false));
  pose.landmark_inliers = 14;
  EXPECT_FALSE(proposer.wants(blind, view, pose, false)) << "too few landmarks";
  pose.landmark_inliers = 15;
  blind.seen.static_weight.assign(blind.seen.features->size(), 0.4F);
  EXPECT_FALSE(proposer.wants(blind, view, pose, false)) << "nothing surely static";
}

TEST(KeyframeProposer, ACandidateTellsWhatWasSeenSinceTheLast) {
  LocalView view;
  view.keyframes = {keyframe_at(1, 0.0)};
  KeyframeProposer proposer(KeyframePolicyConfig{}, 100);
  const TrackedFrame frame = frame_at(0, view);
  proposer.remember_seen({{LandmarkId(7), 1, 1}, {LandmarkId(5), 1, 0}});
  proposer.remember_seen({{LandmarkId(5), 1, 1}});
  const KeyframeCandidate candidate = proposer.make(frame, 3);
  ASSERT_EQ(candidate.seen.size(), 2U);
  EXPECT_EQ(candidate.seen[0].id, LandmarkId(7));
  EXPECT_EQ(candidate.seen[1].visible, 2);
  EXPECT_EQ(candidate.seen[1].found, 1);
  EXPECT_TRUE(proposer.make(frame, 4).seen.empty());
}

}  // namespace
}  // namespace ygslam
