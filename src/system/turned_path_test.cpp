// Rotations of the final path, held by a gyroscope.
#include <gtest/gtest.h>

#include "system/run_writer.hpp"
#include "system/testing/one_keyframe.hpp"

namespace ygslam {
namespace {

FrameRecord tracked_at_rest(std::uint32_t id) {
  FrameRecord frame;
  frame.frame = FrameId{id};
  frame.stamp = {to_ns(100 + id / 30.0)};
  frame.state = TrackState::kTracking;
  frame.pose.reference = KeyframeId{0};
  return frame;
}

/// A camera at rest that sees points at 2 m; at times it takes a turn for a shift.
Trajectory shaken(bool turns_are_known) {
  Trajectory trajectory;
  for (std::uint32_t i = 1; i <= 60; ++i) {
    FrameRecord frame = tracked_at_rest(i);
    const double error_rad = i % 2 == 0 ? 0.004 : -0.004;
    frame.pose.T_camera_reference =
        SE3(so3_exp({error_rad, 0, 0}), Vec3(0, 2 * error_rad, 0)).inverse();
    frame.rotation_std_rad = 1e-3;
    frame.distance_m = 2;
    if (turns_are_known) frame.turn = {Vec3::Zero(), 5e-5};
    trajectory.emplace_back(frame);
  }
  return trajectory;
}

TEST(Trajectories, TurnsThatAGyroscopeKnowsHoldThePoses) {
  const Map map = testing::map_of_one_keyframe();
  const auto held = final_trajectory(shaken(true), {}, map);
  const auto seen = final_trajectory(shaken(false), {}, map);
  ASSERT_EQ(held.size(), 60U);
  for (std::size_t i = 10; i < 50; ++i) {
    EXPECT_LT(held[i].T_world_camera.angle(), 0.001) << i;
    EXPECT_LT(held[i].T_world_camera.t().norm(), 0.002) << i << ": 0.008 as seen";
    EXPECT_NEAR(seen[i].T_world_camera.angle(), 0.004, 1e-9) << i;
  }
}

}  // namespace
}  // namespace ygslam
