// What is on a screen that plays is told from the room about it, or is not there.
#include "tracking/screen_finder.hpp"

#include <gtest/gtest.h>

#include "tracking/screen_test_world.hpp"

namespace ygslam {
namespace {

using tracking_test::kBackWall_m;
using tracking_test::kCameraMoved;
using tracking_test::kScreenAway_m;
using tracking_test::ScreenRoom;

TEST(ScreenFinder, AVideoThatPansIsNoMotionOfTheCamera) {
  for (const SE3& T_world_camera : {SE3(), kCameraMoved}) {
    const auto answer = ScreenRoom().ask(T_world_camera, Vec3(0.04, 0, 0));
    EXPECT_GT((answer.T_camera_world.inverse().t() - T_world_camera.t()).norm(), 0.02)
        << "all points together take it for one";
    ASSERT_TRUE(answer.out.found);
    EXPECT_TRUE(answer.out.found->moves_camera);
    EXPECT_LT((answer.out.found->T_camera_world.inverse().t() - T_world_camera.t()).norm(), 0.005);
    EXPECT_NEAR(answer.out.found->screen.plane.normalized().z(), 1, 0.01);
  }
}

/// All that is on the screen, and ten points beside it.
ScreenRoom::View hardly_beside(ScreenRoom::View view) {
  int beside = 0;
  std::erase_if(view.points, [&](const ScreenFinder::Point& point) {
    const Feature& f = view.seen.features->points[point.feature];
    return f.depth_m > kScreenAway_m + 0.2 && ++beside > 10;
  });
  return view;
}

TEST(ScreenFinder, DepthTellsWhereTheCameraIsIfHardlyAPointIsBesideTheScreen) {
  for (const double step_m : {0.0, 0.012}) {
    const ScreenRoom room;
    const PyramidScales scales(8, 1.2);
    ScreenFinder finder(room.camera(), scales, {});
    room.show_first_frame(finder);
    std::optional<ScreenFinder::Finding> found;
    SE3 T_camera_world;
    for (int i = 1; i < 10 && !found; ++i) {
      const auto view = hardly_beside(room.points(kCameraMoved, Vec3(0, i * step_m, 0)));
      std::vector<PoseObservation> all;
      for (const auto& point : view.points)
        all.push_back(
            {point.p_world, observation_of(view.seen.features->points[point.feature], 1, {}, 1)});
      T_camera_world = solve_pose(room.camera(), T_camera_world, all, {})->T_camera_world;
      found = finder
                  .step({view.seen, T_camera_world, T_camera_world.inverse()}, 0,
                        [&] { return view.points; })
                  .found;
      finder.remember(view.seen, T_camera_world.inverse());
    }
    ASSERT_EQ(found.has_value(), step_m > 0) << "a picture that stands is no screen that plays";
    if (!found) continue;
    EXPECT_GT((T_camera_world.inverse().t() - kCameraMoved.t()).norm(), 0.03) << "by the points";
    EXPECT_LT((found->T_camera_world.inverse().t() - kCameraMoved.t()).norm(), 0.01);
  }
}

TEST(ScreenFinder, DepthAloneHasNoPoseWhereWhatIsSeenMovesOtherwise) {
  const ScreenRoom room;
  const PyramidScales scales(8, 1.2);
  ScreenFinder finder(room.camera(), scales, {});
  room.show_first_frame(finder);
  FrameFeatures now;
  now.frame = room.see(kCameraMoved, 2);
  const auto by_depth = [&] { return finder.by_depth({now, SE3(), SE3()}, SE3()); };
  ASSERT_TRUE(by_depth());
  EXPECT_LT((by_depth()->T_camera_world.inverse().t() - kCameraMoved.t()).norm(), 0.015);
  auto somebody = std::make_shared<RgbdFrame>(*now.frame);
  for (int v = 0; v < somebody->depth_m.height(); ++v)
    for (int u = 0; u < 100; ++u) somebody->depth_m.at(u, v) = 1;
  now.frame = somebody;
  EXPECT_FALSE(by_depth());
}

TEST(ScreenFinder, AStillPictureIsASurfaceLikeOthers) {
  for (const SE3& T_world_camera : {SE3(), kCameraMoved}) {
    const auto answer = ScreenRoom().ask(T_world_camera, Vec3::Zero());
    EXPECT_FALSE(answer.out.found);
    EXPECT_FALSE(answer.out.undecided);
  }
}

TEST(DepthAgreement, IsBestAtTheTrueMotionAndPointsToIt) {
  const ScreenRoom room;
  const DepthSamples before(room.camera(), room.see(SE3(), 1)->depth_m);
  const FramePtr now = room.see(kCameraMoved, 2);
  const auto at = [&](const SE3& T_world_camera) {
    return compare_depth(room.camera(), before, now->depth_m, T_world_camera.inverse());
  };
  const DepthAgreement truth = at(kCameraMoved);
  const DepthAgreement wrong = at(kCameraMoved * SE3(so3_exp(Vec3(0, 0.01, 0)), Vec3(0.03, 0, 0)));
  EXPECT_GT(truth.samples, 500);
  EXPECT_LT(truth.possible_gain(), 25);
  EXPECT_GT(wrong.possible_gain(), 50);
  EXPECT_LT(truth.cost, wrong.cost);
}

TEST(PlanarPatches, ScreenPillarFloorAndWallAreApart) {
  const ScreenRoom room;
  const FramePtr frame = room.see(SE3(), 1);
  const PlanarPatches patches(room.camera(), frame->depth_m);
  const auto patch_of = [&](const Vec3& p) {
    return patches.patch_at(room.camera().project(p).cast<float>(), p);
  };
  const int screen = patch_of({0.1, 0.1, kScreenAway_m});
  ASSERT_GE(screen, 0);
  EXPECT_EQ(patch_of({-0.5, -0.3, kScreenAway_m}), screen);
  EXPECT_NE(patch_of({-1.6, -0.6, kBackWall_m}), screen);
  EXPECT_EQ(patch_of({0.1, 0.1, kScreenAway_m + 0.5}), -1) << "behind it";
  EXPECT_LT(
      distance_m(patches.planes()[static_cast<std::size_t>(screen)], {0.3, -0.2, kScreenAway_m}),
      0.01);
}

}  // namespace
}  // namespace ygslam
