#include "motion/checks/epipolar_check.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "motion/motion_test_world.hpp"

namespace ygslam {
namespace {

using motion_test::make_point_world;
using motion_test::PointWorld;
using motion_test::PointWorldConfig;

/// What a perfect previous frame would have said.
std::vector<MotionLabel> true_labels(const PointWorld& world) {
  std::vector<MotionLabel> labels;
  for (const auto moving : world.moving)
    labels.push_back(moving ? MotionLabel::kDynamic : MotionLabel::kStatic);
  return labels;
}

struct Rates {
  double recall = 0;       // of the moving points
  double false_alarm = 0;  // of the static points
};

Rates rates(const PointWorld& world, const EpipolarCheck& check) {
  double moving = 0, found = 0, fixed = 0, wrong = 0;
  for (std::size_t i = 0; i < world.moving.size(); ++i) {
    const bool flagged = check.points[i].label == MotionLabel::kDynamic;
    (world.moving[i] ? moving : fixed) += 1;
    (world.moving[i] ? found : wrong) += flagged ? 1 : 0;
  }
  return {moving > 0 ? found / moving : 0, fixed > 0 ? wrong / fixed : 0};
}

TEST(EpipolarCheck, FlagsCubeMovingAcrossEpipolarLines) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Rng rng(seed);
    PointWorldConfig config;
    config.cube_step_m = Vec3(0, 0.05, 0);  // the camera moves mostly sideways
    const PointWorld world = make_point_world(config, rng);
    const auto check = check_epipolar(world.flow, true_labels(world), {}, rng);
    ASSERT_EQ(check.state, CheckState::kDone);
    EXPECT_GT(rates(world, check).recall, 0.95) << "seed " << seed;
    EXPECT_LT(rates(world, check).false_alarm, 0.02) << "seed " << seed;
    EXPECT_GT(check.fit_quality, 0.9);
  }
}

TEST(EpipolarCheck, FlagsNothingInAStaticScene) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Rng rng(seed);
    PointWorldConfig config;
    config.cube_points = 0;
    config.noise_px = 0.2;  // bounded at 0.6 px, the threshold is 1 px
    const PointWorld world = make_point_world(config, rng);
    for (const bool prior : {true, false}) {
      EpipolarConfig motion;
      motion.prior = prior;
      const auto check = check_epipolar(world.flow, true_labels(world), motion, rng);
      ASSERT_EQ(check.state, CheckState::kDone);
      EXPECT_EQ(rates(world, check).false_alarm, 0) << "seed " << seed << " prior " << prior;
    }
  }
}

TEST(EpipolarCheck, PriorWinsWhereMoversAreTheMajority) {
  double classic_wrong = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Rng rng(seed);
    PointWorldConfig config;
    config.static_points = 120;
    config.cube_points = 240;
    config.cube_step_m = Vec3(0.03, 0.06, 0);
    const PointWorld world = make_point_world(config, rng);
    const auto labels = true_labels(world);
    EpipolarConfig classic;
    classic.prior = false;
    const auto improved_check = check_epipolar(world.flow, labels, {}, rng);
    const auto classic_check = check_epipolar(world.flow, labels, classic, rng);
    EXPECT_GT(rates(world, improved_check).recall, 0.95) << "seed " << seed;
    EXPECT_LT(rates(world, improved_check).false_alarm, 0.02) << "seed " << seed;
    const Rates r = rates(world, classic_check);
    classic_wrong += r.recall < 0.5 || r.false_alarm > 0.3 ? 1 : 0;
  }
  EXPECT_GE(classic_wrong, 8);  // of 10
}

TEST(EpipolarCheck, PriorSurvivesWrongLabelsOfTheFrameBefore) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Rng rng(seed);
    PointWorldConfig config;
    config.cube_step_m = Vec3(0, 0.05, 0);
    const PointWorld world = make_point_world(config, rng);
    auto labels = true_labels(world);
    for (auto& label : labels)
      if (rng.uniform() < 0.15)
        label = label == MotionLabel::kStatic ? MotionLabel::kDynamic : MotionLabel::kStatic;
    const auto check = check_epipolar(world.flow, labels, {}, rng);
    EXPECT_GT(rates(world, check).recall, 0.95) << "seed " << seed;
    EXPECT_LT(rates(world, check).false_alarm, 0.02) << "seed " << seed;
  }
}

TEST(EpipolarCheck, TooFewStaticPointsGiveNoVerdict) {
  Rng rng(1);
  const PointWorld world = make_point_world({}, rng);
  std::vector<MotionLabel> labels(world.flow.size(), MotionLabel::kDynamic);
  for (int i = 0; i < 19; ++i) labels[i] = MotionLabel::kStatic;
  const auto check = check_epipolar(world.flow, labels, {}, rng);
  EXPECT_EQ(check.state, CheckState::kTooFewStatic);
  EXPECT_FALSE(check.F);
  EXPECT_EQ(check.candidates, 19);
  for (const auto& point : check.points) {
    EXPECT_EQ(point.label, MotionLabel::kUnknown);
    EXPECT_LT(point.distance_px, 0);
  }
  EXPECT_EQ(check_epipolar({}, {}, {}, rng).state, CheckState::kTooFewStatic);
}

TEST(EpipolarCheck, VotersWithoutCommonMotionGiveNoVerdict) {
  Rng rng(1);
  std::vector<PointPair> flow(60);
  for (auto& pair : flow)
    pair = {{rng.uniform(0, 319), rng.uniform(0, 239)}, {rng.uniform(0, 319), rng.uniform(0, 239)}};
  EpipolarConfig config;
  config.ransac.min_inliers = 40;
  const auto check =
      check_epipolar(flow, std::vector<MotionLabel>(60, MotionLabel::kStatic), config, rng);
  EXPECT_EQ(check.state, CheckState::kNoFit);
  for (const auto& point : check.points) EXPECT_EQ(point.label, MotionLabel::kUnknown);
}

TEST(EpipolarCheck, BeyondTheThresholdAPointIsDynamic) {
  Rng rng(2);
  PointWorldConfig world_config;
  world_config.cube_step_m = Vec3(0, 0.05, 0);
  const PointWorld world = make_point_world(world_config, rng);
  EpipolarConfig config;
  config.tau_px = 0.7;
  const auto check = check_epipolar(world.flow, true_labels(world), config, rng);
  int within = 0, beyond = 0;
  for (const EpipolarLabel& point : check.points) {
    if (point.distance_px < 0) continue;
    const bool is_dynamic = point.distance_px > config.tau_px;
    EXPECT_EQ(point.label, is_dynamic ? MotionLabel::kDynamic : MotionLabel::kStatic);
    ++(is_dynamic ? beyond : within);
  }
  EXPECT_GT(within, 10);
  EXPECT_GT(beyond, 10);
}

TEST(EpipolarCheck, PureRotationFlagsNoStandingPoint) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Rng rng(seed);
    PointWorldConfig config;
    config.cube_points = 0;
    config.T_current_previous = SE3(so3_exp({0.01, 0.03, 0.0}), Vec3::Zero());
    const PointWorld turned = make_point_world(config, rng);
    const auto rotation = check_epipolar(turned.flow, true_labels(turned), {}, rng);
    ASSERT_EQ(rotation.state, CheckState::kDone);
    EXPECT_EQ(rates(turned, rotation).false_alarm, 0);
  }
}

TEST(EpipolarCheck, PointsThatWereNotFollowedAreNotJudged) {
  Rng rng(3);
  PointWorld world = make_point_world({}, rng);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 50; ++i) world.flow[i].p2_px = Vec2(nan, nan);
  const auto check = check_epipolar(world.flow, true_labels(world), {}, rng);
  ASSERT_EQ(check.state, CheckState::kDone);
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(check.points[i].label, MotionLabel::kUnknown);
    EXPECT_LT(check.points[i].distance_px, 0);
  }
}

}  // namespace
}  // namespace ygslam
