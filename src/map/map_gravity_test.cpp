#include "map/map_gravity.hpp"

#include <gtest/gtest.h>

#include "map/map_test_world.hpp"

namespace ygslam {
namespace {

const Vec3 kDown = Vec3(0.1, 0.95, -0.2).normalized();

class MapGravity : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kKeyframes = 6;

  void feel(std::uint32_t id, const Vec3& down_world, double std_rad) {
    const Keyframe& keyframe = map.keyframe(KeyframeId{id});
    auto data = std::make_shared<KeyframeData>(*keyframe.data);
    data->gravity = {keyframe.T_camera_world.R() * down_world,
                     std_rad * std_rad * Mat3::Identity()};
    map.set_data(KeyframeId{id}, data);
  }
  [[nodiscard]] double angle_rad(std::uint32_t id) const {
    return (measured_gravity(map).at(KeyframeId{id}).direction_world - kDown).norm();
  }

  map_test::World world{100, 1};
  Map map = map_test::true_map(world, kKeyframes).map;
};

TEST_F(MapGravity, WithoutAnImuThereIsNone) { EXPECT_TRUE(measured_gravity(map).empty()); }

TEST_F(MapGravity, IsWhatKeyframesSayTogether) {
  feel(1, kDown, 0.001);
  feel(2, so3_exp({0.01, 0, 0}) * kDown, 0.05);
  feel(4, so3_exp({-0.0001, 0, 0}) * kDown, 0.001);
  const auto all = measured_gravity(map);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_LT(angle_rad(1), 2e-4);
  EXPECT_EQ(all.at(KeyframeId{1}).direction_world, all.at(KeyframeId{4}).direction_world);
  EXPECT_GT(all.at(KeyframeId{1}).information(0, 0), 10 * all.at(KeyframeId{2}).information(0, 0));
  const SE3& T_camera_world = map.keyframe(KeyframeId{4}).T_camera_world;
  EXPECT_LT(direction_residual(all.at(KeyframeId{4}), T_camera_world).norm(), 3e-4);
}

TEST_F(MapGravity, WhatDisagreesCountsLess) {
  for (std::uint32_t i = 0; i + 1 < kKeyframes; ++i) feel(i, kDown, 0.001);
  feel(kKeyframes - 1, so3_exp({0.3, 0, 0}) * kDown, 0.001);
  EXPECT_LT(angle_rad(0), 0.005);
  const auto all = measured_gravity(map);
  EXPECT_LT(10 * all.at(KeyframeId{kKeyframes - 1}).information.trace(),
            all.at(KeyframeId{0}).information.trace());
}

TEST_F(MapGravity, WhatAnImuTakesBackIsForgotten) {
  for (std::uint32_t i = 0; i < kKeyframes; ++i) {
    feel(i, kDown, 0.001);
    auto data = std::make_shared<KeyframeData>(*map.keyframe(KeyframeId{i}).data);
    data->stamp = {1000 + i};
    data->turn.emplace();
    map.set_data(KeyframeId{i}, data);
  }
  EXPECT_FALSE(forget_imu(map, {{1000 + kKeyframes}}));
  EXPECT_TRUE(forget_imu(map, {{1002}}));
  EXPECT_FALSE(forget_imu(map, {{1002}})) << "there is none left";
  EXPECT_EQ(measured_gravity(map).size(), 2U);
  for (const auto& [id, keyframe] : map.keyframes()) {
    EXPECT_EQ(keyframe.data->gravity.has_value(), index(id) < 2) << index(id);
    EXPECT_EQ(keyframe.data->turn.has_value(), index(id) < 2) << index(id);
  }
}

TEST_F(MapGravity, AnotherRunThatGoesOnWithTheMapHasAnotherImu) {
  feel(1, kDown, 0.001);
  auto data = std::make_shared<KeyframeData>(*map.keyframe(KeyframeId{2}).data);
  data->turn.emplace();
  map.set_data(KeyframeId{2}, data);
  map.set_motion(KeyframeId{3}, {KeyframeId{2}, SE3(), Mat6::Identity()});
  map.forget_frames();
  EXPECT_TRUE(measured_gravity(map).empty());
  EXPECT_FALSE(map.keyframe(KeyframeId{2}).data->turn) << "its series are numbered anew";
  EXPECT_FALSE(map.keyframe(KeyframeId{3}).motion);
}

// A submap leans as it likes until it is joined.
TEST_F(MapGravity, EachSubmapHasItsOwn) {
  feel(1, kDown, 0.001);
  const auto seen = world.see(SE3(so3_exp({0.2, 0.1, 0}), {3, 0, 0}), 500);
  const KeyframeId root = map_test::add_keyframe(map, seen, kNoKeyframe);
  feel(index(root), so3_exp({0.2, 0, 0}) * kDown, 0.001);
  EXPECT_LT(angle_rad(1), 1e-9);
  EXPECT_GT(angle_rad(index(root)), 0.15);
  map.join(root, KeyframeId{1});
  EXPECT_EQ(angle_rad(1), angle_rad(index(root)));
}

/// Keyframes that see nothing, one after the other.
class GrowingMap : public ::testing::Test {
 protected:
  void add(const Vec3& down_world) {
    const KeyframeId id = map.next_keyframe_id();
    auto data = std::make_shared<KeyframeData>();
    data->id = id;
    data->features = std::make_shared<const Features>();
    const SE3 T_camera_world(so3_exp({0, 0.1 * index(id), 0}), Vec3::Zero());
    data->gravity = {T_camera_world.R() * down_world, 1e-6 * Mat3::Identity()};
    map.add_keyframe(data, T_camera_world, last(), {});
  }
  [[nodiscard]] KeyframeId last() const {
    return map.keyframes().empty() ? kNoKeyframe : map.keyframes().rbegin()->first;
  }
  /// In the world, as the newest keyframe has it.
  [[nodiscard]] Vec3 down() {
    const KeyframeId newest = last();
    return gravity.of(map, {&newest, 1}).at(newest).direction_world;
  }
  [[nodiscard]] Vec3 down_of_all() const {
    return measured_gravity(map).at(last()).direction_world;
  }

  Map map{{map_test::kLevels, map_test::kScale}};
  GravityOfGrowingMap gravity;
};

TEST_F(GrowingMap, AllOfFewKeyframesSayWhereGravityPulls) {
  for (int i = 0; i < 50; ++i) {
    add(so3_exp({1e-3 * i, 0, 0}) * kDown);
    EXPECT_EQ(down(), down_of_all()) << i;
  }
  const KeyframeId newest = last();
  const auto one = gravity.of(map, {&newest, 1}).at(newest),
             same = measured_gravity(map).at(newest);
  EXPECT_EQ(one.information, same.information);
  EXPECT_EQ(one.direction_camera, same.direction_camera);
}

TEST_F(GrowingMap, ManyAreLookedAtAgainOnceAShareOfThemIsNew) {
  for (int i = 0; i < 1280; ++i) add(kDown);
  EXPECT_LT((down() - kDown).norm(), 1e-9);
  const Vec3 other = so3_exp({0.01, 0, 0}) * kDown;
  int until_seen = 0;
  for (; down() != down_of_all() || until_seen == 0; ++until_seen) {
    add(other);
    ASSERT_LT((down() - down_of_all()).norm(), 5e-4) << "it is never far off";
    ASSERT_LT(until_seen, 50);
  }
  EXPECT_GT(until_seen, 15) << "each keyframe had all looked at";
}

TEST_F(GrowingMap, ACorrectionHasAllLookedAt) {
  for (int i = 0; i < 1280; ++i) add(kDown);
  const Vec3 before = down();
  const SE3 T_old_new(so3_exp({0.5, 0, 0}), Vec3::Zero());
  for (const auto& [id, keyframe] : map.keyframes())
    map.set_pose(id, keyframe.T_camera_world * T_old_new);
  EXPECT_EQ(down(), before);
  gravity.forget();
  EXPECT_EQ(down(), down_of_all());
  EXPECT_GT((down() - before).norm(), 0.3);
}

TEST_F(GrowingMap, ANewSubmapIsLookedAtAtOnce) {
  for (int i = 0; i < 1280; ++i) add(kDown);
  (void)down();
  auto data = std::make_shared<KeyframeData>(*map.keyframe(last()).data);
  data->id = map.next_keyframe_id();
  data->gravity = {Vec3::UnitZ(), 1e-6 * Mat3::Identity()};
  map.add_keyframe(data, SE3(), kNoKeyframe, {});
  EXPECT_EQ(down(), Vec3::UnitZ());
}

}  // namespace
}  // namespace ygslam
