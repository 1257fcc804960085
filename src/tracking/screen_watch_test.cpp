// Where a screen that is known leaves few points, depth carries the pose.
#include "tracking/screen_watch.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "tracking/screen_test_world.hpp"

namespace ygslam {
namespace {

using tracking_test::kCameraMoved;
using tracking_test::ScreenRoom;

const Vec3 kPanned_m(0.04, 0, 0);

SE3 shifted(const SE3& T_world_camera, const Vec3& by_m) {
  return (T_world_camera * SE3(Mat3::Identity(), by_m)).inverse();
}

double off_m(const SE3& T_camera_world) {
  return (T_camera_world.inverse().t() - kCameraMoved.t()).norm();
}

/// A camera at the origin, which then moves while the video pans.
class ScreenWatchTest : public ::testing::Test {
 protected:
  ScreenWatchTest() {
    last_.seen.frame = room_.see(SE3(), 1);
    auto features = std::make_shared<Features>();
    for (const ScreenFinder::Point& point : view_.points) {
      Feature f;
      f.uv_px = f.ideal_px = room_.camera().project(point.p_world).cast<float>();
      f.depth_m = static_cast<float>(point.p_world.z());
      features->points.push_back(f);
      features->descriptors.emplace_back();
    }
    last_.landmarks.assign(features->size(), kNoLandmark);
    last_.seen.features = std::move(features);
    watch_.follow({last_.seen, {}, {}, {}}, SE3());
  }
  /// A pose by so many points.
  [[nodiscard]] PoseResult pose(const SE3& T_camera_world, int inliers) const {
    PoseResult result;
    result.T_camera_world = T_camera_world;
    result.landmarks.assign(view_.seen.features->size(), kNoLandmark);
    result.matches = result.inliers = inliers;
    return result;
  }
  /// The screen becomes known, by a pose that its video led astray.
  void see_it_play() {
    ObservedFrame now{view_.seen, {}, {}, {}};
    now.evidence.points.resize(view_.points.size());
    now.evidence.links.resize(view_.points.size());
    std::iota(now.evidence.links.begin(), now.evidence.links.end(), 0);
    const SE3 T_wrong = room_.ask(kCameraMoved, kPanned_m).T_camera_world;
    const auto looked = watch_.step({now, view_.seen, pose(T_wrong, 400), before()});
    ASSERT_TRUE(looked.without);
    EXPECT_LT(off_m(looked.without->T_camera_world), 0.005);
  }
  [[nodiscard]] ScreenWatch::Before before() const {
    return {last_, T_last_world_, T_odom_last_, map_};
  }
  [[nodiscard]] std::optional<PoseResult> carried(const std::optional<PoseResult>& by_points,
                                                  const SE3& T_guess_world) const {
    return watch_.carried(by_points, T_guess_world, view_.seen, before());
  }

  ScreenRoom room_;
  ScreenRoom::View view_ = room_.points(kCameraMoved, kPanned_m);
  PointClassifier classifier_{{.mode = DynamicMode::kGeometry}, room_.camera(), 1};
  ScreenWatch watch_{{}, room_.camera(), PyramidScales(8, 1.2), {}, classifier_};
  LocalView map_;
  TrackedFrame last_;
  SE3 T_last_world_, T_odom_last_;
  SE3 T_true_ = kCameraMoved.inverse();
  SE3 T_dragged_ = shifted(kCameraMoved, Vec3(0.06, 0, 0));
  SE3 T_far_ = shifted(kCameraMoved, Vec3(0, 0, -0.5));
};

TEST_F(ScreenWatchTest, DepthCarriesThePoseWhereAKnownScreenLeavesFewPoints) {
  EXPECT_FALSE(carried(pose(T_dragged_, 50), T_true_)) << "no screen is known";
  EXPECT_FALSE(carried(std::nullopt, T_true_));
  see_it_play();
  for (const auto& by_points : {std::optional(pose(T_dragged_, 99)), std::optional<PoseResult>()}) {
    const auto found = carried(by_points, T_true_);
    ASSERT_TRUE(found);
    EXPECT_LT(off_m(found->T_camera_world), 0.015);
    EXPECT_TRUE(found->contested) << "such a frame is weak";
    EXPECT_EQ(found->landmarks, std::vector<LandmarkId>(view_.points.size(), kNoLandmark));
    EXPECT_GT(found->inliers, 200);
    EXPECT_LE(found->inliers, found->matches);
    ASSERT_TRUE(found->covariance);
    EXPECT_GT(found->position_std_m, 0);
    EXPECT_LT(found->position_std_m, 0.03);
  }
}

TEST_F(ScreenWatchTest, PointsCarryItWhereTheyAreManyOrAgreeWithDepth) {
  see_it_play();
  EXPECT_FALSE(carried(pose(T_dragged_, 100), T_true_)) << "many";
  EXPECT_FALSE(carried(pose(T_true_, 50), T_true_)) << "depth says the same";
}

TEST_F(ScreenWatchTest, DepthIsLookedForFromTheFrameBeforeAndFromThePrediction) {
  see_it_play();
  const auto from_last = carried(std::nullopt, T_far_);
  ASSERT_TRUE(from_last);
  EXPECT_LT(off_m(from_last->T_camera_world), 0.015);
  T_last_world_ = T_far_;
  T_odom_last_ = T_far_.inverse();
  const auto from_guess = carried(std::nullopt, T_true_);
  ASSERT_TRUE(from_guess);
  EXPECT_LT(off_m(from_guess->T_camera_world), 0.015);
  EXPECT_FALSE(carried(std::nullopt, T_far_)) << "from neither";
}

}  // namespace
}  // namespace ygslam
