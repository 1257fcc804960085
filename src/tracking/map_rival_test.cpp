// The map's say where what was followed from the frame before went astray.
#include "tracking/map_rival.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "tracking/point_test_world.hpp"

namespace ygslam {
namespace {

using map_test::World;
using tracking_test::PointScene;
using tracking_test::pose_error;

class MapRivalTest : public ::testing::Test {
 protected:
  /// As something near carried it along: 0.05 m off, by points that the map does not have.
  static PoseResult dragged() {
    PoseResult pose;
    pose.T_camera_world = SE3(Mat3::Identity(), Vec3(0.05, 0, 0)) * World::pose(6);
    pose.matches = 100;
    pose.inliers = 70;
    pose.landmark_inliers = 20;
    return pose;
  }
  std::optional<PoseResult> ask(const std::optional<PoseResult>& followed) {
    return MapRival(scene_.estimator, older_speak_)
        .step({followed, scene_.frame, evidence_, scene_.view, guess_})
        .pose;
  }

  /// Of the features that are chosen, else kNoLandmark.
  [[nodiscard]] std::vector<LandmarkId> landmarks_of(
      const std::function<bool(std::size_t)>& chosen) const {
    std::vector<LandmarkId> result(scene_.frame.features->size(), kNoLandmark);
    for (std::size_t i = 0; i < result.size(); ++i)
      if (chosen(i))
        result[i] = scene_.truth.landmark[static_cast<std::size_t>(scene_.now.point[i])];
    return result;
  }
  /// A floor that moves takes the pose along, with so many of twenty features, 0.2 s after the last
  /// keyframe and 1.85 s after the first.
  /// @param since_long it is in the map, which keyframes have of the last second alone else.
  MapRival::Output ask_on_a_floor_that_moves(std::size_t of_twenty, bool since_long) {
    PoseResult on_floor = dragged();
    on_floor.landmarks = landmarks_of([&](std::size_t i) { return i % 20 < of_twenty; });
    const SE3 T_moved = on_floor.T_camera_world.inverse() * World::pose(6);
    std::vector<std::uint8_t> moves(scene_.view.landmarks.size());
    on_floor.landmark_inliers = 0;
    for (const LandmarkId id : on_floor.landmarks) {
      const std::int32_t i = scene_.view.find(id);
      if (i < 0) continue;
      Vec3& p_world = scene_.view.landmarks[static_cast<std::size_t>(i)].p_world;
      p_world = T_moved * p_world;
      moves[static_cast<std::size_t>(i)] = 1;
      ++on_floor.landmark_inliers;
    }
    on_floor.inliers = on_floor.landmark_inliers;
    on_floor.matches = 2 * on_floor.inliers;
    for (std::size_t k = 1; k < scene_.view.keyframes.size() && !since_long; ++k)
      for (std::int32_t& i : scene_.view.keyframes[k].landmarks)
        if (i >= 0 && moves[static_cast<std::size_t>(i)] != 0) i = -1;
    auto soon_after = std::make_shared<RgbdFrame>(*scene_.frame.frame);
    soon_after->stamp = {scene_.view.keyframes.front().data->stamp.ns + 200'000'000};
    scene_.frame.frame = soon_after;
    return MapRival(scene_.estimator, older_speak_)
        .step({on_floor, scene_.frame, evidence_, scene_.view, guess_});
  }

  SE3 guess_ = SE3(Mat3::Identity(), Vec3(0.02, -0.01, 0)) * World::pose(6);
  PointScene scene_{3};
  bool older_speak_ = true;
  std::vector<PointEvidence> evidence_ = std::vector<PointEvidence>(scene_.frame.features->size());
};

TEST_F(MapRivalTest, APoseThatTheMapContradictsIsReplaced) {
  // What was followed had taken the room for what moves.
  scene_.frame.static_weight.assign(scene_.frame.static_weight.size(), 0.0F);
  for (const auto& followed : {std::optional(dragged()), std::optional<PoseResult>()}) {
    const auto rival = ask(followed);
    ASSERT_TRUE(rival);
    EXPECT_LT(pose_error(rival->T_camera_world, World::pose(6)), 0.006);
    EXPECT_GT(rival->landmark_inliers, 100);
    EXPECT_FALSE(rival->contested);
  }
}

TEST_F(MapRivalTest, APoseThatTheMapSharesStands) {
  PoseResult right = dragged();
  right.T_camera_world = World::pose(6);
  EXPECT_FALSE(ask(right));
  PoseResult mapped = dragged();
  mapped.landmark_inliers = 400;
  mapped.landmarks = landmarks_of([](std::size_t i) { return i < 400; });
  EXPECT_FALSE(ask(mapped));
}

TEST_F(MapRivalTest, AFewPointsOfTheMapAreContested) {
  for (std::size_t i = 45; i < evidence_.size(); ++i)
    evidence_[i].semantic.label = SemanticLabel::kMovable;
  const auto rival = ask(std::nullopt);
  ASSERT_TRUE(rival);
  EXPECT_TRUE(rival->contested);
  for (PointEvidence& point : evidence_) point.on_screen = true;
  EXPECT_FALSE(ask(std::nullopt));
}

TEST_F(MapRivalTest, WhatTheMapHadBeforeSpeaksAgainstWhatItHasSinceAMoment) {
  const auto out = ask_on_a_floor_that_moves(14, false);
  ASSERT_TRUE(out.pose);
  EXPECT_LT(pose_error(out.pose->T_camera_world, World::pose(6)), 0.006);
  EXPECT_FALSE(out.pose->contested);
}

TEST_F(MapRivalTest, InModesWithoutGeometryAllOfTheMapIsStatic) {
  older_speak_ = false;
  const auto out = ask_on_a_floor_that_moves(14, false);
  EXPECT_FALSE(out.pose);
  EXPECT_FALSE(out.contested);
}

TEST_F(MapRivalTest, WhatTheMapPrefersByALittleIsContested) {
  const auto out = ask_on_a_floor_that_moves(9, true);
  EXPECT_FALSE(out.pose);
  EXPECT_TRUE(out.contested);
}

TEST_F(MapRivalTest, FewerPointsThatMoveOtherwiseContestNothing) {
  const auto out = ask_on_a_floor_that_moves(12, true);
  EXPECT_FALSE(out.pose);
  EXPECT_FALSE(out.contested);
}

TEST_F(MapRivalTest, IsAskedWhereFewPointsAgree) {
  PoseResult pose = dragged();
  EXPECT_TRUE(MapRival::is_wanted(pose, scene_.view)) << "70 of 100";
  pose.matches = 80;
  EXPECT_FALSE(MapRival::is_wanted(pose, scene_.view)) << "70 of 80";
  pose.inliers = pose.matches = 40;
  EXPECT_TRUE(MapRival::is_wanted(pose, scene_.view)) << "few";
  EXPECT_TRUE(MapRival::is_wanted(std::nullopt, scene_.view));
  EXPECT_FALSE(MapRival::is_wanted(std::nullopt, LocalView{})) << "there is no map yet";
}

}  // namespace
}  // namespace ygslam
