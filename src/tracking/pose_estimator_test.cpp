// Pose by matching against the last frame and the map, and by the last frame alone, on a world of
// points.
#include "tracking/pose_estimator.hpp"

#include <gtest/gtest.h>

#include "tracking/point_test_world.hpp"

namespace ygslam {
namespace {

using map_test::World;
using tracking_test::features_of;
using tracking_test::PointScene;
using tracking_test::pose_error;

SE3 perturbed(const SE3& T, double translation_m, double rotation_rad, Rng& rng) {
  Vec6 twist;
  for (int i = 0; i < 6; ++i) twist[i] = rng.normal(0, i < 3 ? translation_m : rotation_rad);
  return SE3::exp(twist) * T;
}

/// A wall on which one point in fifteen has a double 0.2 m aside.
World with_doubles(std::uint64_t seed) {
  World world(1500, seed);
  auto& points = world.points();
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].p_world.z() = 2.5;
    points[i].size_m = 0.007;
    if (i % 15 != 1) continue;
    points[i] = points[i - 1];
    points[i].p_world.x() += 0.2;
  }
  return world;
}

TEST(PoseEstimator, FindsThePoseFromAPerturbedGuess) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    PointScene scene(seed);
    Rng rng(seed);
    const auto pose = scene.track(perturbed(World::pose(6), 0.03, 0.01, rng), rng);
    ASSERT_TRUE(pose) << seed;
    EXPECT_LT(pose_error(pose->T_camera_world, World::pose(6)), 0.006) << seed;
    EXPECT_GT(pose->landmark_inliers, 200);
    // What it calls a match is one.
    for (std::uint32_t i = 0; i < pose->landmarks.size(); ++i) {
      if (pose->landmarks[i] == kNoLandmark) continue;
      ASSERT_EQ(pose->landmarks[i], scene.truth.landmark[scene.now.point[i]]);
    }
  }
}

TEST(PoseEstimator, AGuessFarOffIsSavedByDescriptors) {
  PointScene scene(11);
  Rng rng(1);
  Vec6 turn = Vec6::Zero();
  turn[4] = 0.35;  // 180 px
  const auto pose = scene.track(SE3::exp(turn) * World::pose(6), rng);
  ASSERT_TRUE(pose);
  EXPECT_LT(pose_error(pose->T_camera_world, World::pose(6)), 0.01);
}

TEST(PoseEstimator, DoublesInTheWindowDoNotEndTheSearch) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    PointScene scene(with_doubles(seed), {.noise_px = 0.2});
    Rng rng(seed);
    Vec6 turn = Vec6::Zero();
    turn[4] = -0.08;  // 42 px: where a point was expected its double is
    const auto pose = scene.track(SE3::exp(turn) * World::pose(6), rng);
    ASSERT_TRUE(pose) << seed;
    EXPECT_LT(pose_error(pose->T_camera_world, World::pose(6)), 0.006) << seed;
  }
}

TEST(PoseEstimator, PointsWithoutWeightHaveNoSay) {
  PointScene scene(12);
  // Four in ten features moved aside, all by the same 12 px: a mover's.
  auto moved = std::make_shared<Features>(*scene.now.features);
  for (std::size_t i = 0; i < moved->size(); ++i) {
    if (i % 10 >= 4) continue;
    moved->points[i].ideal_px.x() += 12;
    moved->points[i].uv_px.x() += 12;
    scene.frame.static_weight[i] = 0.0F;
  }
  scene.frame.features = moved;
  scene.frame.grid = FeatureGrid(*moved, scene.world.camera().ideal_bounds());
  Rng rng(2);
  const auto pose = scene.track(World::pose(6), rng);
  ASSERT_TRUE(pose);
  EXPECT_LT(pose_error(pose->T_camera_world, World::pose(6)), 0.006);
  for (std::size_t i = 0; i < moved->size(); ++i) {
    if (i % 10 < 4) {
      EXPECT_EQ(pose->landmarks[i], kNoLandmark);
    }
  }
}

TEST(PoseEstimator, PointsThatMovedUnnoticedDisagree) {
  PointScene scene(13);
  auto moved = std::make_shared<Features>(*scene.now.features);
  for (std::size_t i = 0; i < moved->size(); i += 5) {
    moved->points[i].ideal_px.y() += 10;
    moved->points[i].uv_px.y() += 10;
  }
  scene.frame.features = moved;
  scene.frame.grid = FeatureGrid(*moved, scene.world.camera().ideal_bounds());
  Rng rng(3);
  const auto pose = scene.track(World::pose(6), rng);
  ASSERT_TRUE(pose);
  EXPECT_LT(pose_error(pose->T_camera_world, World::pose(6)), 0.006);
  int agreeing = 0;
  for (std::size_t i = 0; i < moved->size(); i += 5)
    agreeing += pose->landmarks[i] != kNoLandmark ? 1 : 0;
  EXPECT_LT(agreeing, 0.05 * static_cast<double>(moved->size()) / 5);
}

TEST(PoseEstimator, WorksFromTheLastFramesDepthBeforeThereIsAMap) {
  PointScene scene(14);
  scene.last.landmarks.assign(scene.last.landmarks.size(), kNoLandmark);
  Rng rng(4);
  const auto pose = scene.track(scene.frame, LocalView{}, World::pose(5), rng);
  ASSERT_TRUE(pose);
  EXPECT_LT(pose_error(pose->T_camera_world, World::pose(6)), 0.01);
  EXPECT_EQ(pose->landmark_inliers, 0);
}

TEST(PoseEstimator, AnotherWorldGivesNoPose) {
  PointScene scene(15);
  World other(700, 999);
  const auto elsewhere = other.see(World::pose(6), 100);
  Rng rng(5);
  const auto pose = scene.track(features_of(elsewhere), scene.view, World::pose(6), rng);
  EXPECT_TRUE(!pose || pose->landmark_inliers < 15);
}

/// A frame posed a little aside of what its landmarks say alone, in a world then corrected.
struct Corrected : PointScene {
  explicit Corrected(std::uint64_t seed) : PointScene(seed), rng(seed) {
    last.view = std::make_shared<const LocalView>(view);
    last.T_camera_world = perturbed(World::pose(5), 0.002, 0.001, rng);
  }
  Rng rng;
};

TEST(PoseEstimator, AFrameGoesWithItsLandmarks) {
  for (std::uint64_t seed = 31; seed <= 35; ++seed) {
    Corrected scene(seed);
    const SE3 T_new_old = perturbed(SE3(), 0.3, 0.1, scene.rng);
    for (std::size_t i = 0; i < scene.view.landmarks.size(); ++i) {
      ViewLandmark& landmark = scene.view.landmarks[i];
      landmark.p_world = T_new_old * landmark.p_world;
      if (i % 3 == 0) scene.view.landmark_index.erase(landmark.id);  // gone in the meantime
    }
    const SE3 T_camera_new = scene.last.T_camera_world * T_new_old.inverse();
    // Its reference keyframe was moved a little differently.
    const SE3 T_guess_new = perturbed(T_camera_new, 0.005, 0.002, scene.rng);
    const auto followed = scene.estimator.follow_landmarks(scene.last, scene.view, T_guess_new);
    ASSERT_TRUE(followed) << seed;
    EXPECT_LT(pose_error(*followed, T_camera_new), 1e-4) << seed;
    EXPECT_GT(pose_error(T_guess_new, T_camera_new), 1e-3) << seed;
  }
}

TEST(PoseEstimator, WhereLandmarksWentApartAFrameGoesBetweenThem) {
  Corrected scene(36);
  for (std::size_t i = 0; i < scene.view.landmarks.size(); ++i)
    scene.view.landmarks[i].p_world.x() += i % 2 == 0 ? 0.004 : 0.0;
  Vec6 aside = Vec6::Zero();
  aside[0] = -0.004;  // with the one half
  const auto followed = scene.estimator.follow_landmarks(
      scene.last, scene.view, SE3::exp(aside) * scene.last.T_camera_world);
  ASSERT_TRUE(followed);
  const double moved_m = (followed->inverse().t() - scene.last.T_camera_world.inverse().t()).norm();
  EXPECT_GT(moved_m, 0.001);
  EXPECT_LT(moved_m, 0.003);
}

TEST(PoseEstimator, WithoutItsLandmarksAFrameFollowsNothing) {
  Corrected scene(37);
  EXPECT_FALSE(
      scene.estimator.follow_landmarks(scene.last, LocalView{}, scene.last.T_camera_world));
  scene.last.landmarks.assign(scene.last.landmarks.size(), kNoLandmark);
  EXPECT_FALSE(scene.estimator.follow_landmarks(scene.last, scene.view, scene.last.T_camera_world));
}

}  // namespace
}  // namespace ygslam
