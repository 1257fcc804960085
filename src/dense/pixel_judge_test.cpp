// What the pixels of views show, and which of it is not there any more.
#include "dense/pixel_judge.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "dense/scene_naming/parts_test_world.hpp"
#include "geometry/properties_testing.hpp"

namespace ygslam {
namespace {

using object_test::kChair;
using object_test::Parts;
using object_test::view_pose;

const volume_test::Cuboid kCarton{
    Vec3(-0.15, 0.8, -0.6), Vec3(0.25, 1.2, -0.3), kNoSceneObject, {120, 90, 40}};

void take_chair_away(Parts& parts) { parts.world.cuboids.erase(parts.world.cuboids.begin()); }

std::map<DenseViewId, PixelState> states_of(const Parts& parts) {
  std::map<DenseViewId, PixelState> states;
  for (const auto& [id, view] : parts.store.all())
    if (const PixelState* state = parts.judge.state(id)) states.emplace(id, *state);
  return states;
}

TEST(PixelJudge, ViewsOfOneObjectHaveOneNumber) {
  Parts parts;
  EXPECT_EQ(parts.judge.state(KeyframeId{0}), nullptr);
  parts.look_around();
  ASSERT_EQ(parts.judge.objects().objects().size(), 2U);
  const PixelState* first = parts.judge.state(KeyframeId{0});
  ASSERT_NE(first, nullptr);
  ASSERT_EQ(first->ids.size(), 2U);
  EXPECT_NE(first->ids[0], first->ids[1]);
  for (const auto& [id, state] : states_of(parts)) EXPECT_EQ(state, *first);
}

TEST(PixelJudge, AnObjectThatWasTakenAwayIsRemovedFromEarlierViews) {
  Parts parts;
  parts.look_around();
  take_chair_away(parts);
  for (std::uint32_t i = 7; i < 10; ++i) parts.look(i, view_pose(i - 4), i);
  int removed = 0;
  for (std::uint32_t i = 0; i < 7; ++i) {
    const PixelState& state = *parts.judge.state(KeyframeId{i});
    removed += state.ids[0] == kRemovedObject && !state.removed_objects.empty() ? 1 : 0;
    EXPECT_NE(state.ids[1], kRemovedObject) << "the screen stays";
  }
  EXPECT_EQ(removed, 7);
  EXPECT_TRUE(parts.judge.state(KeyframeId{9})->removed_objects.empty());
}

TEST(PixelJudge, AForgottenViewLeavesNothing) {
  Parts parts;
  parts.look_around();
  for (std::uint32_t i = 0; i < 7; ++i) {
    parts.judge.forget(KeyframeId{i}, Parts::at_s(i));
    EXPECT_EQ(parts.judge.state(KeyframeId{i}), nullptr);
  }
  EXPECT_TRUE(parts.judge.objects().objects().empty());
}

// Nobody who looks at the map waits for all of it, nor sees half of it.
TEST(PixelJudge, WhatIsJudgedAnewInPiecesCountsAtOnce) {
  Parts parts, direct;
  std::map<KeyframeId, SE3> moved;
  for (std::uint32_t i = 0; i < 40; ++i) {
    if (i == 30) take_chair_away(parts), take_chair_away(direct);
    parts.look(i, view_pose(i % 7), i);
    direct.look(i, view_pose(i % 7), i);
    moved[KeyframeId{i}] = SE3(Mat3::Identity(), Vec3(0.3, 0, 0.1)) * view_pose(i % 7);
  }
  EXPECT_FALSE(parts.judge.is_judging());
  parts.store.set_poses(moved);
  direct.store.set_poses(moved);
  const auto before = states_of(parts);
  int pieces = 0;
  while (true) {
    ASSERT_TRUE(parts.judge.judge_corrected(parts.store, parts.fused));
    ++pieces;
    if (!parts.judge.is_judging()) break;
    EXPECT_EQ(states_of(parts), before);
  }
  EXPECT_EQ(pieces, 3);
  direct.judge.judge_objects(direct.store, direct.fused);
  EXPECT_EQ(states_of(parts), states_of(direct));
  EXPECT_EQ(parts.judge.objects().objects().size(), direct.judge.objects().objects().size());
}

/// Keyframes 0 to 6 with the chair, then the same without it.
const std::vector<DenseView>& fourteen_views() {
  static const std::vector<DenseView> kGiven = [] {
    Parts parts;
    std::vector<DenseView> views;
    for (std::uint32_t i = 0; i < 14; ++i) {
      if (i == 7) take_chair_away(parts);
      views.push_back(parts.store.at(parts.give(i, view_pose(i % 7), i % 7)));
    }
    return views;
  }();
  return kGiven;
}

/// Whatever was judged before, in whatever order: all anew is a function of views and poses.
RC_GTEST_PROP(PixelJudgeProperty, AllAnewDependsOnViewsAndPosesAlone, ()) {
  Parts walked, direct;
  const auto away_from = *rc::gen::inRange<std::uint32_t>(3, 8);
  for (Parts* parts : {&walked, &direct}) {
    for (std::uint32_t i = 0; i < 7; ++i) {
      parts->poses[KeyframeId{i}] = view_pose(i);
      parts->store.add(KeyframeId{i}, fourteen_views()[i < away_from ? i : 7 + i]);
    }
    parts->store.set_poses(parts->poses);
  }
  const auto order = *rc::gen::container<std::vector<std::uint32_t>>(
      *rc::gen::inRange<std::size_t>(0, 7), rc::gen::inRange<std::uint32_t>(0, 7));
  for (const std::uint32_t i : order)
    if (walked.judge.state(KeyframeId{i}) == nullptr)
      walked.judge.judge_objects(KeyframeId{i}, walked.store, walked.fused);
  walked.judge.judge_objects(walked.store, walked.fused);
  direct.judge.judge_objects(direct.store, direct.fused);
  RC_ASSERT(states_of(walked) == states_of(direct));
}

TEST(PixelJudge, InTheirOrderOneByOneIsTheSameAsAllAnew) {
  Parts parts;
  parts.look_around();
  const auto one_by_one = states_of(parts);
  parts.judge.judge_objects(parts.store, parts.fused);
  EXPECT_EQ(states_of(parts), one_by_one);
}

TEST(PixelJudge, JudgesAnewWherePosesWereCorrectedByMoreThanACell) {
  Parts parts;
  parts.look_around();
  EXPECT_FALSE(parts.judge.judge_corrected(parts.store, parts.fused));
  const auto moved = [&](double way_m) {
    auto poses = parts.poses;
    for (auto& [id, pose] : poses) pose = SE3(Mat3::Identity(), Vec3(way_m, 0, 0)) * pose;
    parts.store.set_poses(poses);
  };
  moved(0.04);
  EXPECT_FALSE(parts.judge.judge_corrected(parts.store, parts.fused));
  moved(0.06);
  EXPECT_TRUE(parts.judge.judge_corrected(parts.store, parts.fused)) << "objects";
  EXPECT_TRUE(parts.judge.judge_corrected(parts.store, parts.fused)) << "then space";
  EXPECT_FALSE(parts.judge.judge_corrected(parts.store, parts.fused));
}

/// A carton stands there for four views, then for three it does not.
struct CartonTakenAway {
  Parts parts;
  CartonTakenAway() {
    parts.world.cuboids.push_back(kCarton);
    for (std::uint32_t i = 0; i < 4; ++i) parts.look(i, view_pose(2 + i % 3), i);
    parts.world.cuboids.pop_back();
    for (std::uint32_t i = 4; i < 7; ++i) parts.look(i, view_pose(2 + i % 3), i);
  }
};

TEST(PixelJudge, TheLastViewsDecideWhatNobodyNamed) {
  CartonTakenAway room;
  PixelJudge& judge = room.parts.judge;
  judge.judge_space(room.parts.fused);
  for (std::uint32_t i = 0; i < 7; ++i) {
    EXPECT_EQ(judge.state(KeyframeId{i})->removed != nullptr, i < 4) << i;
    EXPECT_EQ(judge.decides(KeyframeId{i}), i >= 4) << i;
  }
  const auto once = states_of(room.parts);
  judge.judge_space(room.parts.fused);
  EXPECT_EQ(states_of(room.parts), once) << "said twice it is no more";
}

TEST(PixelJudge, AChangeIsSeenAsItHappens) {
  CartonTakenAway room;
  PixelJudge& judge = room.parts.judge;
  judge.judge_space(KeyframeId{6}, room.parts.fused);
  EXPECT_TRUE(judge.state(KeyframeId{0})->removed);
  EXPECT_TRUE(judge.decides(KeyframeId{6}));
}

TEST(PixelJudge, WhatWasFoundInSpaceStaysUntilSpaceIsJudgedAgain) {
  CartonTakenAway room;
  PixelJudge& judge = room.parts.judge;
  judge.judge_space(room.parts.fused);
  const RemovedCells removed = judge.state(KeyframeId{0})->removed;
  for (const auto& [id, view] : room.parts.store.all()) room.parts.fuse(id);
  judge.judge_objects(room.parts.store, room.parts.fused);
  EXPECT_EQ(judge.state(KeyframeId{0})->removed, removed);
}

TEST(SpaceJudge, IsAPureFunctionOfWhatIsFused) {
  CartonTakenAway room;
  const SpaceJudge judge(room.parts.config, room.parts.camera);
  const SpaceVerdict before = judge.judge(room.parts.fused);
  ASSERT_FALSE(before.cells.empty());
  room.parts.judge.judge_space(room.parts.fused);  // and what it takes back is taken back
  for (const auto& [id, view] : room.parts.store.all()) room.parts.fuse(id);
  const SpaceVerdict after = judge.judge(room.parts.fused);
  EXPECT_EQ(after.deciding, before.deciding);
  ASSERT_EQ(after.cells.size(), before.cells.size());
  for (const auto& [id, cells] : before.cells) {
    EXPECT_EQ(after.cells.at(id).removed, cells.removed);
    EXPECT_EQ(after.cells.at(id).appeared, cells.appeared);
  }
}

TEST(SpaceJudge, ASingleViewDecidesNothing) {
  Parts parts;
  parts.world.cuboids.push_back(kCarton);
  for (std::uint32_t i = 0; i < 4; ++i) parts.look(i, view_pose(2 + i % 3), i);
  parts.world.cuboids.pop_back();
  parts.look(4, view_pose(3), 4);
  const SpaceVerdict verdict = SpaceJudge(parts.config, parts.camera).judge(parts.fused);
  for (const auto& [id, cells] : verdict.cells) EXPECT_TRUE(cells.removed.empty());
  EXPECT_TRUE(verdict.deciding.empty());
}

TEST(SpaceJudge, WhatAppearedIsCarvedByNoEarlierView) {
  Parts parts;
  for (std::uint32_t i = 0; i < 7; ++i) parts.look(i, view_pose(2 + i % 3), i);
  parts.world.cuboids.push_back(kCarton);
  for (std::uint32_t i = 7; i < 11; ++i) parts.look(i, view_pose(2 + i % 3), i);
  const SpaceVerdict verdict = SpaceJudge(parts.config, parts.camera).judge(parts.fused);
  std::size_t appeared = 0;
  for (std::uint32_t i = 0; i < 7; ++i) {
    const auto its = verdict.cells.find(KeyframeId{i});
    appeared += its == verdict.cells.end() ? 0 : its->second.appeared.size();
    EXPECT_FALSE(verdict.deciding.contains(KeyframeId{i}));
  }
  EXPECT_GT(appeared, 100U);
}

}  // namespace
}  // namespace ygslam
