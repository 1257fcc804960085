#include "map/map_bytes.hpp"

#include <gtest/gtest.h>

#include "map/map_test_world.hpp"

namespace ygslam {
namespace {

using map_test::World;

Map some_map(World& world) {
  Map map = map_test::true_map(world, 5).map;
  map.remove_keyframe(KeyframeId{2});
  return map;
}

TEST(MapBytes, ComesBackAsItWas) {
  World world(200, 31);
  const Map map = some_map(world);
  const std::string bytes = to_bytes(map);
  const auto back = map_from_bytes(bytes, world.camera().ideal_bounds());
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(to_bytes(*back), bytes);
  EXPECT_EQ(back->version(), map.version());
  EXPECT_EQ(back->next_keyframe_id(), map.next_keyframe_id());
  ASSERT_EQ(back->landmark_count(), map.landmark_count());
  for (const auto& [id, keyframe] : map.keyframes()) {
    const Keyframe& other = back->keyframe(id);
    EXPECT_EQ(other.T_camera_world.t(), keyframe.T_camera_world.t());
    EXPECT_EQ(other.landmarks, keyframe.landmarks);
    EXPECT_EQ(other.covisible, keyframe.covisible);
    EXPECT_EQ(other.data->frame, kNoFrame) << "masks belong to frames of their own run";
    EXPECT_EQ(other.data->grid.size(), keyframe.data->grid.size());
  }
  EXPECT_EQ(back->keyframe_of(FrameId{0}), kNoKeyframe);
  EXPECT_EQ(back->resolved_pose(KeyframeId{2}).t(), map.resolved_pose(KeyframeId{2}).t());
}

TEST(MapBytes, AnEmptyMapComesBackToo) {
  const auto back = map_from_bytes(to_bytes(Map({8, 1.2})), {0, 0, 640, 480});
  ASSERT_TRUE(back.ok());
  EXPECT_TRUE(back->keyframes().empty());
}

TEST(MapBytes, NoDamageGetsThrough) {
  World world(60, 32);
  const std::string bytes = to_bytes(some_map(world));
  const auto bounds = world.camera().ideal_bounds();
  for (std::size_t length = 0; length < bytes.size(); length += 1 + bytes.size() / 97)
    EXPECT_FALSE(map_from_bytes(std::span(bytes).first(length), bounds).ok()) << length;
  Rng rng(1);
  for (int trial = 0; trial < 200; ++trial) {
    std::string damaged = bytes;
    damaged[rng.below(static_cast<std::uint32_t>(bytes.size()))] ^=
        static_cast<char>(1 + rng.below(255));
    const auto read = map_from_bytes(damaged, bounds);
    ASSERT_FALSE(read.ok());
    EXPECT_EQ(read.error().kind, ErrorKind::kSavedMap);
  }
}

}  // namespace
}  // namespace ygslam
