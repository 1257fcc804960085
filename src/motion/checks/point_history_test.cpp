#include "motion/checks/point_history.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "motion/motion_test_world.hpp"

namespace ygslam {
namespace {

using motion_test::small_camera;

constexpr int kStanding = 200;
constexpr int kMoving = 40;

/// Points before a camera that moves sideways; the last kMoving creep by step_m a frame.
struct CreepingWorld {
  std::vector<Vec3> start_world;
  Vec3 step_m;

  CreepingWorld(const Vec3& step, std::uint64_t seed) : step_m(step) {
    Rng rng(seed);
    for (int i = 0; i < kStanding + kMoving; ++i)
      start_world.emplace_back(rng.uniform(-0.8, 0.8), rng.uniform(-0.6, 0.6),
                               rng.uniform(1.5, 3.0));
  }
  [[nodiscard]] static SE3 T_camera_world(int frame) {
    return SE3(so3_exp(Vec3(0, 0.004, 0.001) * frame), Vec3(-0.004, 0.001, 0.002) * frame);
  }
  [[nodiscard]] Vec3 p_camera(int i, int frame) const {
    const Vec3 moved = i < kStanding ? Vec3(0, 0, 0) : Vec3(step_m * frame);
    return T_camera_world(frame) * (start_world[i] + moved);
  }
  /// Features of a frame, followed into the next.
  [[nodiscard]] std::vector<FollowedPoint> points(int frame) const {
    std::vector<FollowedPoint> points;
    for (int i = 0; i < std::ssize(start_world); ++i) {
      const Vec3 now = p_camera(i, frame);
      const auto depth_m = static_cast<float>(now.z());
      points.push_back({small_camera().project(now),
                        small_camera().project(p_camera(i, frame + 1)),
                        now.z(),
                        {depth_m, depth_m}});
    }
    return points;
  }
};

std::vector<std::int32_t> same_order() {
  std::vector<std::int32_t> link(kStanding + kMoving);
  std::iota(link.begin(), link.end(), 0);
  return link;
}

const std::vector<std::uint8_t> kAllVote(kStanding + kMoving, 1);

/// The judgement of the step from frame `last` to the next, after following from frame 0.
HistoryCheck follow(const CreepingWorld& world, PointHistory& samples, int last) {
  for (int frame = 0; frame <= last; ++frame) {
    samples.push(world.points(frame), same_order(), CreepingWorld::T_camera_world(frame));
  }
  const SE3 T_current_newest =
      CreepingWorld::T_camera_world(last + 1) * CreepingWorld::T_camera_world(last).inverse();
  return samples.check(small_camera(), world.points(last), kAllVote, T_current_newest);
}

TEST(PointHistory, MotionTooSlowForTheFlowAddsUp) {
  // 4 mm a frame at 1.5 to 3 m: 0.35 to 0.7 px, far below what the flow's check can tell.
  const CreepingWorld world(Vec3(0.004, 0, 0), 1);
  PointHistory samples{PointHistoryConfig{}};
  const HistoryCheck judged = follow(world, samples, 16);
  for (int i = 0; i < kStanding + kMoving; ++i) {
    const bool moves = judged.residual[i].px.any_depth_px > judged.limit_px;
    EXPECT_EQ(moves, i >= kStanding) << judged.residual[i].px.any_depth_px;
  }
}

TEST(PointHistory, StandingPointsLieWhereTheirSamplesPutThem) {
  const CreepingWorld world(Vec3(0, 0, 0), 2);
  PointHistory samples{PointHistoryConfig{}};
  const HistoryCheck judged = follow(world, samples, 20);
  for (const HistoryResidual& residual : judged.residual) {
    EXPECT_GE(residual.age_frames, PointHistoryConfig{}.min_age_frames);
    EXPECT_LT(residual.px.own_depth_px, 1e-3);
  }
}

TEST(PointHistory, YoungSamplesAndForgottenOnesSayNothing) {
  const CreepingWorld world(Vec3(0, 0, 0), 3);
  PointHistory young{PointHistoryConfig{}};
  for (const HistoryResidual& residual : follow(world, young, 1).residual)
    EXPECT_EQ(residual.age_frames, 0);
  PointHistory cleared{PointHistoryConfig{}};
  static_cast<void>(follow(world, cleared, 10));
  cleared.clear();
  for (const HistoryResidual& residual : follow(world, cleared, 1).residual)
    EXPECT_LT(residual.px.own_depth_px, 0);
}

TEST(PointHistory, AFeatureThatContinuesNoneStartsAnew) {
  const CreepingWorld world(Vec3(0, 0, 0), 4);
  PointHistory samples{PointHistoryConfig{}};
  static_cast<void>(follow(world, samples, 10));
  samples.push(world.points(11), std::vector<std::int32_t>(kStanding + kMoving, -1),
               CreepingWorld::T_camera_world(11));
  for (const HistoryResidual& residual :
       samples.check(small_camera(), world.points(11), kAllVote, SE3()).residual)
    EXPECT_EQ(residual.age_frames, 0);
}

}  // namespace
}  // namespace ygslam
