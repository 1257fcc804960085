#include "system/map_merge.hpp"

#include <gtest/gtest.h>

#include "io/testing/temp_folder.hpp"
#include "loop/loop_test_world.hpp"
#include "map/map_bytes.hpp"
#include "map_file/map_file.hpp"

namespace ygslam {
namespace {

using loop_test::RingWorld;
using loop_test::Walk;

constexpr Walk kFirstWalk{.keyframes = 30, .drift_m = 0.02, .drift_rad = 0.003};
constexpr Walk kSecondWalk{.keyframes = 30, .first = 15, .drift_m = -0.02, .drift_rad = 0.002};

/// In a world frame of its own.
Map moved(Map map, const SE3& T_new_old) {
  MapPatch patch = map.start_patch();
  for (const auto& [id, keyframe] : map.keyframes())
    patch.poses.push_back(
        {id, keyframe.T_camera_world, keyframe.T_camera_world * T_new_old.inverse()});
  map.apply(patch);
  return map;
}

const SE3 kElsewhere = SE3::exp((Vec6() << 3, -7, 1, 0.1, -0.2, 1.3).finished());

TEST(MapAlignment, FindsHowOneMapLiesToAnother) {
  RingWorld ring(41);
  const Map a = ring.walk(kFirstWalk);
  const Map b = moved(ring.walk(kSecondWalk), kElsewhere);
  const MapAlignment alignment = align_maps(a, b, ring.camera(), {});
  ASSERT_EQ(alignment.outcome, MapAlignment::Outcome::kAligned);
  EXPECT_GE(alignment.independent, 3);
  EXPECT_GT(alignment.extent_m, 1);
  EXPECT_LT((alignment.T_a_b * kElsewhere).log().norm(), 0.1);
}

TEST(MapAlignment, WithoutACommonPlaceThereIsNone) {
  RingWorld ring(42), other(43);
  const Map a = ring.walk(kFirstWalk);
  EXPECT_EQ(align_maps(a, other.walk(kFirstWalk), ring.camera(), {}).outcome,
            MapAlignment::Outcome::kNoOverlap);
  const Map opposite = ring.walk({.keyframes = 8, .first = 38, .drift_m = 0, .drift_rad = 0});
  EXPECT_EQ(align_maps(a, opposite, ring.camera(), {}).outcome, MapAlignment::Outcome::kNoOverlap);
}

TEST(MapAlignment, TwoWaysToFitAreAmbiguous) {
  RingWorld ring(44);
  ring.repeat_half_a_turn_away();
  const Map a = ring.walk({.keyframes = 48, .drift_m = 0, .drift_rad = 0});
  const Map b = moved(ring.walk({.keyframes = 12, .drift_m = 0, .drift_rad = 0}), kElsewhere);
  EXPECT_EQ(align_maps(a, b, ring.camera(), {}).outcome, MapAlignment::Outcome::kAmbiguous);
}

TEST(MapMerge, MakesOneMapInTheFrameOfTheFirst) {
  RingWorld ring(45);
  const Map a = ring.walk(kFirstWalk);
  const Map b = moved(ring.walk(kSecondWalk), kElsewhere);
  const MapAlignment alignment = align_maps(a, b, ring.camera(), {});
  const Map merged = merge_maps(a, b, alignment, ring.camera(), {});
  EXPECT_EQ(merged.keyframes().size(), a.keyframes().size() + b.keyframes().size());
  EXPECT_LT(merged.landmark_count(), a.landmark_count() + b.landmark_count());
  for (const auto& [id, keyframe] : merged.keyframes()) {
    const int i = static_cast<int>(index(id));
    const SE3 T_true = i < kFirstWalk.keyframes
                           ? RingWorld::true_pose(kFirstWalk, i)
                           : RingWorld::true_pose(kSecondWalk, i - kFirstWalk.keyframes);
    EXPECT_LT((keyframe.position_world() - T_true.inverse().t()).norm(), 0.06) << i;
  }
  // Both see the same landmarks now.
  const Keyframe& second = merged.keyframe(KeyframeId(kFirstWalk.keyframes + 3));
  EXPECT_LT(index(second.covisible.begin()->first), static_cast<unsigned>(kFirstWalk.keyframes));
  // What a file holds is whole.
  const testing::TempFolder folder;
  ASSERT_TRUE(save_map(folder.path() / "both.map", merged, ring.camera()).ok());
  const auto back = load_map(folder.path() / "both.map");
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(to_bytes(*back), to_bytes(merged));
}

}  // namespace
}  // namespace ygslam
