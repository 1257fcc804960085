// What a view says of a place where an object was seen.
#include "dense/place_check.hpp"

#include <gtest/gtest.h>

#include "volume/volume_test_world.hpp"

namespace ygslam {
namespace {

using volume_test::Cuboid;
using volume_test::look_at;
using volume_test::World;

const Cuboid kStanding{Vec3(-0.2, 0.4, -0.2), Vec3(0.2, 1.2, 0.2), SceneObjectId{1}};
const Cuboid kFolding{Vec3(-0.6, -1.2, -0.7), Vec3(0.6, 1.2, -0.6)};       // hides all of it
const Cuboid kHalfFolding{Vec3(-0.6, -1.2, -0.7), Vec3(0.02, 1.2, -0.6)};  // and half of it

SE3 camera_pose() { return look_at(Vec3(0, 0.4, -1.4), Vec3(0, 0.8, 0)); }
Timestamp at_s(double t_s) { return {static_cast<std::int64_t>(1e9 * t_s)}; }

DepthView view_of(std::vector<Cuboid> cuboids, const SE3& T_world_camera = camera_pose()) {
  World world;
  world.cuboids = std::move(cuboids);
  return volume_test::render(world, T_world_camera);
}

/// Its front, as three views showed it.
KnownObject known_box() {
  KnownObject object;
  for (int i = 0; i < 3; ++i) object.seen.insert(at_s(0.1 * i));
  object.shown = object.seen;
  for (double x = -0.19; x < 0.2; x += 0.03) {
    for (double y = 0.45; y < 1.15; y += 0.03) {
      const Vec3 p_world(x, y, -0.2);
      SurfacePatch& patch = object.patches[cell_key(p_world, 0.025)];
      patch.sum_world += p_world;
      ++patch.points;
      patch.views = patch.in_sight = 3;
      object.extent_world.extend(p_world);
    }
  }
  return object;
}

class PlaceCheck : public ::testing::Test {
 protected:
  bool look(const DepthView& view, double t_s, const SE3& T_world_camera = camera_pose()) {
    return check_place(view, T_world_camera, at_s(t_s), config_, box_);
  }
  [[nodiscard]] bool would_say(const DepthView& view) const {
    return sees_through(view, camera_pose(), config_, box_);
  }
  PlaceCheckConfig config_;
  KnownObject box_ = known_box();
};

TEST_F(PlaceCheck, AnObjectThatStandsThereIsShown) {
  const std::size_t before = box_.shown.size();
  EXPECT_FALSE(look(view_of({kStanding}), 1));
  EXPECT_FALSE(box_.is_leaving);
  EXPECT_EQ(box_.empty_observations, 0);
  EXPECT_EQ(box_.shown.size(), before + 1) << "whether a mask names it or not";
  EXPECT_FALSE(would_say(view_of({kStanding})));
}

TEST_F(PlaceCheck, AnEmptyPlaceIsBelievedTheSecondTime) {
  EXPECT_TRUE(would_say(view_of({})));
  EXPECT_FALSE(look(view_of({}), 1));
  EXPECT_TRUE(box_.is_leaving);
  EXPECT_FALSE(box_.found_empty);
  EXPECT_TRUE(look(view_of({}), 1.5));
  EXPECT_EQ(box_.found_empty, at_s(1.5));
}

TEST_F(PlaceCheck, WhatIsSeenInBetweenBeginsTheCountAnew) {
  look(view_of({}), 1);
  look(view_of({kStanding}), 1.5);
  EXPECT_FALSE(look(view_of({}), 2));
  EXPECT_TRUE(look(view_of({}), 2.5));
}

TEST_F(PlaceCheck, WhatIsHiddenStays) {
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(look(view_of({kFolding}), 1 + i));
  EXPECT_FALSE(box_.is_leaving);
  EXPECT_EQ(box_.empty_observations, 0);
  EXPECT_EQ(box_.shown.size(), 3U) << "and is not shown";
  EXPECT_FALSE(would_say(view_of({kFolding})));
}

TEST_F(PlaceCheck, ViewsOfElsewhereSayNothing) {
  const SE3 away = look_at(Vec3(0, 0, 0.5), Vec3(0, 0, 1.5));
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(look(view_of({}, away), 1 + i, away));
  EXPECT_EQ(box_.empty_observations, 0);
}

TEST_F(PlaceCheck, HalfOfItMustBeSeenWithinAFewSeconds) {
  const DepthView half = view_of({kHalfFolding});
  config_.min_visible = 0.7;
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(look(half, 1 + i)) << "the other half may stand there";
  EXPECT_GE(box_.empty_observations, config_.min_observations);
  config_.min_visible = 0.3;
  EXPECT_TRUE(look(half, 5));
}

TEST_F(PlaceCheck, ThePartsOfItThatWereSeenLatelyArePutTogether) {
  const Cuboid other_half{Vec3(-0.02, -1.2, -0.7), Vec3(0.6, 1.2, -0.6)};
  config_.min_visible = 0.6;
  EXPECT_FALSE(look(view_of({kHalfFolding}), 1));
  EXPECT_TRUE(look(view_of({other_half}), 2)) << "one half now, the other a second ago";
  box_ = known_box();
  EXPECT_FALSE(look(view_of({kHalfFolding}), 1));
  EXPECT_FALSE(look(view_of({other_half}), 1 + 2 * config_.window_s)) << "which is too long ago";
}

TEST_F(PlaceCheck, NoiseIsNoHole) {
  const DepthView behind =
      view_of({{kStanding.low + Vec3(0, 0, 0.01), kStanding.high, SceneObjectId{1}}});
  EXPECT_FALSE(look(behind, 1));
  EXPECT_FALSE(box_.is_leaving) << "a centimetre farther is the same surface";
  const DepthView far_behind =
      view_of({{kStanding.low + Vec3(0, 0, 0.15), kStanding.high, SceneObjectId{1}}});
  look(far_behind, 2);
  EXPECT_TRUE(box_.is_leaving);
}

}  // namespace
}  // namespace ygslam
