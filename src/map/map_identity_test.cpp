#include "map/map_identity.hpp"

#include <gtest/gtest.h>

#include "map/map_test_world.hpp"

namespace ygslam {
namespace {

std::shared_ptr<KeyframeData> keyframe_at(int pose, std::int64_t stamp_ns = 1'000'000) {
  map_test::World world(60, 3);
  const auto seen = world.see(map_test::World::pose(pose), 1, {0.5, 0.9, 6});
  auto data = std::make_shared<KeyframeData>();
  data->id = KeyframeId{0};
  data->stamp = {stamp_ns};
  data->features = seen.features;
  data->grid = seen.grid;
  return data;
}

TEST(MapIdentity, IsWrittenAsAUuidAndReadBack) {
  const MapIdentity identity{0x6ba7b8109dad41d1, 0x80b400c04fd430c8};
  EXPECT_EQ(to_string(identity), "6ba7b810-9dad-41d1-80b4-00c04fd430c8");
  EXPECT_EQ(parse_identity(to_string(identity)), identity);
  for (const char* bad :
       {"", "6ba7b810", "6BA7B810-9DAD-41D1-80B4-00C04FD430C8", "6ba7b8109dad41d180b400c04fd430c8",
        "6ba7b810-9dad-41d1-80b4-00c04fd430cx", "6ba7b810-9dad-41d1-80b4-00c04fd430c8-"})
    EXPECT_FALSE(parse_identity(bad)) << bad;
}

TEST(MapIdentity, RandomOnesDifferAndHaveTheirVersion) {
  const MapIdentity first = random_identity();
  EXPECT_NE(first, random_identity());
  EXPECT_EQ(to_string(first).at(14), '4');
  EXPECT_EQ(first.low >> 62, 2U);
}

TEST(MapIdentity, OfAKeyframeRepeatsAndIsNoOthers) {
  const MapIdentity identity = identity_of(*keyframe_at(0));
  EXPECT_EQ(identity, identity_of(*keyframe_at(0)));
  EXPECT_NE(identity, identity_of(*keyframe_at(1)));
  EXPECT_NE(identity, identity_of(*keyframe_at(0, 2'000'000)));
  EXPECT_EQ(to_string(identity).at(14), '8');
}

TEST(MapIdentity, StaysWhileTheMapGrows) {
  Map map({map_test::kLevels, map_test::kScale});
  EXPECT_FALSE(map.identity());
  const auto first = keyframe_at(0);
  map.add_keyframe(first, SE3(), kNoKeyframe, std::vector<float>(first->features->size(), 1.0F));
  EXPECT_EQ(map.identity(), identity_of(*first));
  const auto second = keyframe_at(1, 2'000'000);
  second->id = KeyframeId{1};
  map.add_keyframe(second, SE3(), KeyframeId{0},
                   std::vector<float>(second->features->size(), 1.0F));
  EXPECT_EQ(map.identity(), identity_of(*first));

  Map begun({map_test::kLevels, map_test::kScale});
  const MapIdentity given = random_identity();
  begun.set_identity(given);
  begun.add_keyframe(first, SE3(), kNoKeyframe, std::vector<float>(first->features->size(), 1.0F));
  EXPECT_EQ(begun.identity(), given);
}

}  // namespace
}  // namespace ygslam
