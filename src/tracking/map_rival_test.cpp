// The map's say where what was followed from the frame before went astray.
#include "tracking/map_rival.hpp"

#include <gtest/gtest.h>

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
    return MapRival(scene_.estimator)
        .step({followed, scene_.frame, evidence_, scene_.view, guess()});
  }
  static SE3 guess() { return SE3(Mat3::Identity(), Vec3(0.02, -0.01, 0)) * World::pose(6); }

  PointScene scene_{3};
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
