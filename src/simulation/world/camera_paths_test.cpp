#include "simulation/world/camera_paths.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "simulation/world/world_config.hpp"

namespace ygslam::sim {
namespace {

struct Row {
  const char* world;
  double seconds, length_m, speed_mps, turning_deg_per_s;
};
// Table 1 of the paper.
constexpr Row kTable1[] = {{"sitting_static", 23.63, 0.259, 0.011, 1.699},
                           {"walking_halfsphere", 35.81, 7.686, 0.221, 18.267},
                           {"walking_rpy", 30.61, 2.698, 0.091, 20.903},
                           {"walking_static", 24.83, 0.282, 0.012, 1.388},
                           {"walking_xyz", 28.83, 5.791, 0.208, 5.490}};

TEST(CameraPath, KeepsTheDurationsLengthsAndSpeedsOfTable1) {
  for (const Row& row : kTable1) {
    const Result<WorldConfig> world = load_world(row.world);
    ASSERT_TRUE(world.ok()) << world.error().message;
    EXPECT_NEAR(world->seconds, row.seconds, 0.5) << row.world;
    const CameraPath path(world->camera);
    EXPECT_NEAR(path.length_m(), row.length_m, 0.1 * row.length_m) << row.world;
    EXPECT_NEAR(path.measured_speed().translation_mps, row.speed_mps, 0.1 * row.speed_mps)
        << row.world;
    EXPECT_NEAR(path.measured_speed().rotation_deg_per_s, row.turning_deg_per_s,
                0.1 * row.turning_deg_per_s)
        << row.world;
  }
}

TEST(CameraPath, NeverJumpsExceptWhenKidnapped) {
  for (const char* name : {"walking_xyz", "walking_rpy", "walking_halfsphere", "corridor_loop",
                           "long_floor", "kidnap"}) {
    const Result<WorldConfig> world = load_world(name);
    ASSERT_TRUE(world.ok());
    const CameraPath path(world->camera);
    int jumps = 0;
    const double step_s = 1.0 / 60;
    for (double t_s = 0; t_s < std::min(60.0, world->seconds); t_s += step_s) {
      const SE3 change = path.T_world_camera(t_s).inverse() * path.T_world_camera(t_s + step_s);
      if (change.t().norm() > 0.04 || change.angle() > 0.06) ++jumps;
    }
    EXPECT_EQ(jumps, world->camera.kidnaps.size() * 2) << name;
  }
}

TEST(CameraPath, AKidnappingChangesNothingBeforeAndAfter) {
  const Result<WorldConfig> world = load_world("kidnap");
  ASSERT_TRUE(world.ok());
  ASSERT_EQ(world->camera.kidnaps.size(), 1U);
  CameraPathConfig left_alone = world->camera;
  left_alone.kidnaps.clear();
  const CameraPath path(world->camera);
  const CameraPath other(left_alone);
  const Kidnap& kidnap = world->camera.kidnaps[0];
  for (double t_s = 0; t_s < world->seconds; t_s += 0.1) {
    const Vec3 change_m = path.T_world_camera(t_s).t() - other.T_world_camera(t_s).t();
    if (t_s >= kidnap.from_s && t_s < kidnap.until_s) {
      EXPECT_GT(change_m.norm(), 0.5) << t_s;
    } else {
      EXPECT_EQ(change_m.norm(), 0) << t_s;
    }
  }
}

TEST(CameraPath, TwinRoomsReturnSeesTheFirstRoomTwiceAndTheOtherOnceInBetween) {
  const Result<WorldConfig> world = load_world("twin_rooms_return");
  ASSERT_TRUE(world.ok()) << world.error().message;
  const CameraPath path(world->camera);
  std::string rooms;  // 0 is the corridor
  for (double t_s = 0; t_s < world->seconds; t_s += 0.1) {
    const Vec3 at = path.T_world_camera(t_s).t();
    const auto inside = std::find_if(world->rooms.begin(), world->rooms.end(), [&](const auto& r) {
      return (at.head<2>() - r.low).minCoeff() > 0 && (r.high - at.head<2>()).minCoeff() > 0;
    });
    if (inside == world->rooms.end()) continue;  // in a doorway
    const char room = static_cast<char>('0' + (inside - world->rooms.begin()));
    if (rooms.empty() || rooms.back() != room) rooms += room;
  }
  EXPECT_EQ(rooms, "10201");
}

TEST(CameraPath, LookAtPoseLooksAtThePointWithTheImageUpright) {
  const Vec3 at(1, 2, 1.5);
  const Vec3 target(-2, 4, 0.7);
  const SE3 T_camera_world = look_at_pose(at, target).inverse();
  const Vec3 p = T_camera_world * target;
  EXPECT_NEAR(p.x(), 0, 1e-12);
  EXPECT_NEAR(p.y(), 0, 1e-12);
  EXPECT_GT(p.z(), 0);
  EXPECT_LT((T_camera_world * Vec3(target + Vec3(0, 0, 0.1))).y(), 0);  // up is -y in an image
}

}  // namespace
}  // namespace ygslam::sim
