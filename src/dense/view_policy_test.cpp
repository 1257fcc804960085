#include "dense/view_policy.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "dense/scene_naming/parts_test_world.hpp"
#include "geometry/properties_testing.hpp"

namespace ygslam {
namespace {

using object_test::Parts;
using object_test::view_pose;

constexpr KeyframeId kMiddle{3};

/// Of a part of the room that no keyframe shows.
SE3 elsewhere() { return volume_test::look_at(Vec3(0, -0.5, -1), Vec3(0, -0.2, -1.9)); }

bool enters(Parts& parts, DenseViewId id) {
  return parts.policy.enters(id, parts.store.at(id), parts.judge, parts.fused);
}

TEST(ViewPolicy, KeyframesAreNotAskedAndFramesOnce) {
  Parts parts;
  parts.look_around();
  EXPECT_FALSE(parts.policy.is_undecided(kMiddle, parts.store.at(kMiddle)));
  const DenseViewId frame = parts.give(6, elsewhere(), 7, kMiddle);
  EXPECT_TRUE(parts.policy.is_undecided(frame, parts.store.at(frame)));
  ASSERT_TRUE(enters(parts, frame)) << "nobody looked there";
  EXPECT_FALSE(parts.policy.is_undecided(frame, parts.store.at(frame)));
  EXPECT_GT(parts.policy.memory_bytes(), 0U);
  parts.policy.forget(frame);
  EXPECT_TRUE(parts.policy.is_undecided(frame, parts.store.at(frame)));
  EXPECT_EQ(parts.policy.memory_bytes(), 0U);
}

TEST(ViewPolicy, WhatAllKeyframesShowIsNothingNew) {
  Parts parts;
  parts.look_around();
  const DenseViewId frame = parts.give(6, view_pose(3), 7, kMiddle);
  EXPECT_FALSE(enters(parts, frame));
  EXPECT_TRUE(parts.policy.is_undecided(frame, parts.store.at(frame)));
}

TEST(ViewPolicy, AnObjectThatFewViewsShowedIsNew) {
  Parts parts;
  for (std::uint32_t i = 0; i < 4; ++i) parts.look(i, view_pose(3), i);
  const DenseViewId fifth = parts.give(3, view_pose(3), 4, kMiddle);
  ASSERT_TRUE(enters(parts, fifth)) << "four views of the chair, of six";
  parts.fuse(fifth);
  for (int i = 0; i < 3; ++i) parts.fuse(parts.give(3, view_pose(3), 5 + i, kMiddle));
  EXPECT_FALSE(enters(parts, parts.give(3, view_pose(3), 8, kMiddle)));
}

TEST(ViewPolicy, AnEmptyPlaceOfAnObjectIsNew) {
  Parts parts;
  parts.look_around();
  parts.world.cuboids.erase(parts.world.cuboids.begin());
  const DenseViewId frame = parts.give(6, view_pose(3), 7, kMiddle);
  EXPECT_TRUE(enters(parts, frame));
}

TEST(ViewPolicy, SomethingInTheAirIsNewThoughNobodyNamesIt) {
  Parts parts;
  parts.look_around();
  parts.world.cuboids.push_back({Vec3(-0.1, 0.7, -0.9), Vec3(0.2, 1.2, -0.6)});
  EXPECT_TRUE(enters(parts, parts.give(6, view_pose(3), 7, kMiddle)));
}

TEST(ViewPolicy, AFrameIsNeedlessWhenOthersShowTheSameAndItIsOld) {
  DenseMapConfig config;
  config.object_views = 0;
  Parts parts(config);
  parts.look_around();
  const DenseViewId frame = parts.give(6, elsewhere(), 7, kMiddle);
  EXPECT_FALSE(parts.policy.is_needless(frame, parts.judge, parts.fused)) << "it is not in";
  ASSERT_TRUE(enters(parts, frame));
  parts.fuse(frame);
  const int enough = config.reading.min_views + config.spare_views;
  std::uint32_t next = 7;
  for (int i = 0; i < enough; ++i) parts.look(next++, elsewhere(), 8 + i);
  EXPECT_FALSE(parts.policy.is_needless(frame, parts.judge, parts.fused)) << "protected as yet";
  parts.look(next++, view_pose(3), 7.5 + config.protected_s);
  EXPECT_TRUE(parts.policy.is_needless(frame, parts.judge, parts.fused));
  for (std::uint32_t i = 0; i < next; ++i)
    EXPECT_FALSE(parts.policy.is_needless(KeyframeId{i}, parts.judge, parts.fused))
        << "keyframes stay";
}

TEST(ViewPolicy, AFrameWithSurfaceOfItsOwnStays) {
  Parts parts;
  parts.look_around();
  const DenseViewId frame = parts.give(6, elsewhere(), 7, kMiddle);
  ASSERT_TRUE(enters(parts, frame));
  parts.fuse(frame);
  parts.look(7, elsewhere(), 8);
  parts.look(8, view_pose(3), 30);
  EXPECT_FALSE(parts.policy.is_needless(frame, parts.judge, parts.fused));
}

TEST(ViewPolicy, AFrameOfARareObjectStays) {
  for (const int object_views : {2, 20}) {
    DenseMapConfig config;
    config.object_views = object_views;
    Parts parts(config);
    parts.look_around();
    const DenseViewId frame = parts.give(6, view_pose(3), 7, kMiddle);
    parts.policy.enter(frame, parts.store.at(frame).images);
    parts.fuse(frame);
    for (std::uint32_t i = 7; i < 12; ++i) parts.look(i, view_pose(3), 30 + i);
    EXPECT_EQ(parts.policy.is_needless(frame, parts.judge, parts.fused), object_views == 2);
  }
}

TEST(ViewPolicy, OfACrowdedPlaceThoseGoThatShowLeastOfTheirOwn) {
  DenseMapConfig config;
  config.most_near = 2;
  Parts parts(config);
  parts.look_around();
  std::vector<DenseViewId> same, other;
  for (int i = 0; i < 4; ++i) {  // seven keyframes show this, none the other
    same.push_back(parts.give(6, view_pose(3), 7 + i, kMiddle));
    parts.policy.enter(same.back(), parts.store.at(same.back()).images);
    parts.fuse(same.back());
  }
  other.push_back(parts.give(6, elsewhere(), 11, kMiddle));
  parts.policy.enter(other.back(), parts.store.at(other.back()).images);
  parts.fuse(other.back());
  EXPECT_TRUE(parts.policy.crowded_out(view_pose(3), parts.judge, parts.fused).empty())
      << "all are protected";
  parts.look(7, view_pose(0), 40);
  const auto out = parts.policy.crowded_out(view_pose(3), parts.judge, parts.fused);
  ASSERT_EQ(out.size(), 2U);
  for (const DenseViewId id : out) EXPECT_NE(std::find(same.begin(), same.end(), id), same.end());
  EXPECT_TRUE(parts.policy.crowded_out(elsewhere(), parts.judge, parts.fused).empty())
      << "one alone is no crowd";
}

/// Whatever views come and go meanwhile: each that stays is asked about before any is twice.
RC_GTEST_PROP(ViewPolicyProperty, EveryViewHasItsTurn, ()) {
  ViewPolicy policy({}, nullptr);
  ViewStore store;
  const auto count = *rc::gen::inRange<std::uint32_t>(1, 60);
  for (std::uint32_t i = 1; i <= count; ++i) store.add(KeyframeId{i}, {});
  std::map<DenseViewId, int> asked;
  std::size_t total = 0;
  while (total < count) {
    const std::vector<DenseViewId> next = policy.next_views(store);
    RC_ASSERT(!next.empty());
    for (const DenseViewId id : next) ++asked[id];
    total += next.size();
  }
  RC_ASSERT(total == count);
  for (const auto& [id, times] : asked) RC_ASSERT(times == 1);
  store.remove(KeyframeId{*rc::gen::inRange<std::uint32_t>(1, count + 1)});
  for (const DenseViewId id : policy.next_views(store)) RC_ASSERT(store.contains(id));
}

TEST(ViewPolicy, AsksNobodyWhereNobodyIs) {
  ViewPolicy policy({}, nullptr);
  EXPECT_TRUE(policy.next_views({}).empty());
}

}  // namespace
}  // namespace ygslam
