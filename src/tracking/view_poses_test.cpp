#include "tracking/view_poses.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

SE3 along(double x_m) { return {Mat3::Identity(), Vec3(x_m, 0, 0)}; }

/// Keyframes 4 and 9; the first shows landmarks 0 to 29, the second 20 to 119.
LocalView two_keyframes() {
  LocalView view;
  for (std::uint32_t i = 0; i < 120; ++i) {
    view.landmark_index[LandmarkId{i}] = i;
    view.landmarks.emplace_back().id = LandmarkId{i};
  }
  const auto add = [&](std::uint32_t id, double x_m, int from, int to) {
    auto data = std::make_shared<KeyframeData>();
    data->id = KeyframeId{id};
    ViewKeyframe keyframe{std::move(data), along(x_m), {-1}, 0};
    for (int i = from; i < to; ++i) keyframe.landmarks.push_back(i);
    view.keyframes.push_back(std::move(keyframe));
  };
  add(4, 1, 0, 30);
  add(9, 2, 20, 120);
  view.origin = KeyframeId{0};
  view.others = {{KeyframeId{0}, along(0.5)}};
  return view;
}

TrackedFrame frame_that_sees(std::uint32_t from, std::uint32_t to) {
  TrackedFrame frame;
  frame.landmarks.push_back(kNoLandmark);
  for (std::uint32_t i = from; i < to; ++i) frame.landmarks.push_back(LandmarkId{i});
  frame.landmarks.push_back(LandmarkId{5000});  // not in view any more
  return frame;
}

TEST(ViewPoses, ThereAndBackAgain) {
  const LocalView view = two_keyframes();
  const KeyframeRelativePose pose = relative_to_keyframe(along(7), view);
  EXPECT_EQ(pose.reference, KeyframeId{4});
  EXPECT_NEAR(pose.T_camera_reference.t().x(), 6, 1e-12);
  EXPECT_NEAR(pose_in(view, pose)->t().x(), 7, 1e-12);
}

TEST(ViewPoses, BeforeTheFirstViewTheFirstKeyframeIsTheWorld) {
  const KeyframeRelativePose pose = relative_to_keyframe(along(7), LocalView{});
  EXPECT_EQ(pose.reference, kNoKeyframe);
  EXPECT_NEAR(pose.T_camera_reference.t().x(), 7, 1e-12);
  // Later that keyframe has a number, and may have been moved.
  EXPECT_NEAR(pose_in(two_keyframes(), pose)->t().x(), 7.5, 1e-12);
}

TEST(ViewPoses, OfAKeyframeThatTheViewDoesNotKnowThereIsNone) {
  EXPECT_FALSE(pose_in(two_keyframes(), {KeyframeId{77}, SE3()}));
}

TEST(ViewPoses, AnotherReferenceIsBetterOnlyWhereItSharesClearlyMore) {
  const LocalView view = two_keyframes();
  EXPECT_EQ(better_reference(frame_that_sees(20, 120), view), KeyframeId{9});
  EXPECT_FALSE(better_reference(frame_that_sees(0, 30), view));
  EXPECT_FALSE(better_reference(frame_that_sees(10, 40), view)) << "20 with each";
  EXPECT_FALSE(better_reference(frame_that_sees(10, 50), view)) << "20 and 30";
  EXPECT_EQ(better_reference(frame_that_sees(10, 51), view), KeyframeId{9}) << "20 and 31";
  EXPECT_FALSE(better_reference(frame_that_sees(200, 300), view)) << "nothing";
  EXPECT_FALSE(better_reference(frame_that_sees(0, 30), LocalView{}));
}

TEST(ViewPoses, TheNearestReferenceIsOfThePlaceAndOfWhereItLooks) {
  const LocalView view = two_keyframes();  // of which 4 is the reference
  EXPECT_FALSE(nearest_reference(along(1.2), view));
  EXPECT_EQ(nearest_reference(along(1.8), view), KeyframeId{9});
  EXPECT_FALSE(nearest_reference(along(1), LocalView()));
  LocalView turned = view;
  turned.keyframes[1].T_camera_world = SE3(so3_exp(Vec3(0, 2, 0)), Vec3(2, 0, 0));
  EXPECT_FALSE(nearest_reference(along(1.8), turned)) << "nearer, but it looks elsewhere";
}

TEST(ViewPoses, DistancesAreOfTheCentres) {
  const SE3 turned = SE3(so3_exp(Vec3(0, 1, 0)), Vec3::Zero()) * along(3);
  EXPECT_NEAR(centre_distance_m(turned, along(3)), 0, 1e-12);
  EXPECT_NEAR(centre_distance_m(turned, along(1)), 2, 1e-12);
}

}  // namespace
}  // namespace ygslam
