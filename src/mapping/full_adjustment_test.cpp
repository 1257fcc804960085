#include "mapping/full_adjustment.hpp"

#include <gtest/gtest.h>

#include "geometry/random_vector.hpp"
#include "map/map_test_world.hpp"

namespace ygslam {
namespace {

using map_test::World;

constexpr int kWalkKeyframes = 8;

double pose_error(const Map& map) {
  double sum = 0;
  for (const auto& [id, keyframe] : map.keyframes()) {
    const SE3 T_true = World::pose(static_cast<int>(index(id)));
    sum += (keyframe.T_camera_world * T_true.inverse()).log().norm();
  }
  return sum;
}

/// Every keyframe but the first and every landmark is off by some centimetres.
Map bent_map(World& world) {
  Map map = map_test::true_map(world, kWalkKeyframes, {.noise_px = 0.3}).map;
  Rng rng(5);
  for (int i = 1; i < kWalkKeyframes; ++i) {
    Vec6 twist;
    for (int k = 0; k < 6; ++k) twist[k] = rng.normal(0, 0.01);
    map.set_pose(KeyframeId(i), SE3::exp(twist) * map.keyframe(KeyframeId(i)).T_camera_world);
  }
  std::vector<LandmarkId> ids;
  map.for_each_landmark([&](const Landmark& l) { ids.push_back(l.id); });
  std::sort(ids.begin(), ids.end());
  for (const LandmarkId id : ids) {
    const Vec2 off = random_normals<2>(rng);
    map.set_position(id, map.landmark(id).p_world + 0.02 * Vec3(off.x(), off.y(), 0));
  }
  return map;
}

TEST(FullAdjustment, TakesTheErrorsOutOfAWholeMap) {
  World world(500, 21);
  Map map = bent_map(world);
  const double before = pose_error(map);
  const auto patch = solve(world.camera(), make_full_adjustment(map, {}), {});
  ASSERT_TRUE(patch);
  map.apply(*patch);
  EXPECT_LT(pose_error(map), 0.1 * before);
  EXPECT_EQ(map.keyframe(KeyframeId{0}).T_camera_world.t(), World::pose(0).t()) << "the gauge";
}

TEST(FullAdjustment, KeepsWhatCameWhileItWasComputed) {
  World world(500, 22);
  Map map = bent_map(world);
  auto job = make_full_adjustment(map, {});
  const auto seen = world.see(World::pose(kWalkKeyframes), 1000);
  const KeyframeId later = map_test::add_keyframe(map, seen, KeyframeId(kWalkKeyframes - 1));
  const SE3 T_later_parent = map.keyframe(later).T_camera_world *
                             map.keyframe(KeyframeId(kWalkKeyframes - 1)).T_camera_world.inverse();
  const auto patch = solve(world.camera(), std::move(job), {});
  ASSERT_TRUE(patch);
  map.apply(*patch);
  const SE3 T_now = map.keyframe(later).T_camera_world *
                    map.keyframe(KeyframeId(kWalkKeyframes - 1)).T_camera_world.inverse();
  EXPECT_LT((T_now * T_later_parent.inverse()).log().norm(), 1e-9);
}

TEST(FullAdjustment, GivenUpItChangesNothing) {
  World world(500, 23);
  const Map map = bent_map(world);
  const std::atomic<bool> abort{true};
  EXPECT_FALSE(solve(world.camera(), make_full_adjustment(map, {}), {}, &abort));
}

}  // namespace
}  // namespace ygslam
