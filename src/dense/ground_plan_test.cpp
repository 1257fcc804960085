// The live ground plan: of views by themselves, and of a room while it changes.
#include "dense/ground_plan.hpp"

#include <gtest/gtest.h>

#include "dense/scene_naming/object_test_world.hpp"

namespace ygslam {
namespace {

constexpr double kSide_m = 0.05;

/// Space above a floor at 0, of which each view says something of a few columns.
struct Columns {
  SpaceLayer space{SpaceConfig{}};
  GroundPlan plan;
  Columns() : Columns(GroundPlanConfig{}) {}
  explicit Columns(const GroundPlanConfig& config) : plan(config) {
    plan.set_floor({Vec3(0, 0, 1), 0, true});
  }

  using Height = std::pair<double, double>;  // from, to [m]
  struct View {
    std::vector<Height> hits, through;
  };
  static SeenSpace seen_of(const View& view, int x, int y) {
    std::map<BlockKey, std::pair<CellMask, CellMask>> blocks;
    const auto mark = [&](const std::vector<Height>& heights, bool is_hit) {
      for (const auto& [low_m, high_m] : heights)
        for (int z = static_cast<int>(std::lround(low_m / kSide_m)); z * kSide_m < high_m - 1e-9;
             ++z) {
          auto& [hits, through] = blocks[block_key({x >> 3, y >> 3, z >> 3})];
          (is_hit ? hits : through).set(x & 7, y & 7, z & 7);
        }
    };
    mark(view.hits, true);
    mark(view.through, false);
    SeenSpace seen;
    for (const auto& [key, masks] : blocks) seen.add(key, masks.first, masks.second);
    return seen;
  }
  void look(const View& view, int x = 3, int y = 5) {
    const SeenSpace seen = seen_of(view, x, y);
    space.count(seen, {}, 1, 1);
    plan.observe(seen);
    plan.update(space, space.take_changed());
  }
  [[nodiscard]] GroundState at(int x = 3, int y = 5) const {
    const GroundGrid grid = plan.grid();
    const int column = x - static_cast<int>(std::lround(grid.origin_floor.x() / kSide_m));
    const int row = y - static_cast<int>(std::lround(grid.origin_floor.y() / kSide_m));
    if (column < 0 || row < 0 || column >= grid.width || row >= grid.height)
      return GroundState::kUnknown;
    return grid.cells[static_cast<std::size_t>(row * grid.width + column)];
  }
};

const Columns::View kNothingThere{{}, {{0, 1.6}}};
const Columns::View kTableTop{{{0.7, 0.75}}, {{0, 0.65}, {0.8, 1.6}}};

TEST(GroundPlan, IsFreeWhereTheWholeColumnWasSeen) {
  Columns columns;
  EXPECT_EQ(columns.at(), GroundState::kUnknown);
  columns.look(kNothingThere);
  EXPECT_EQ(columns.at(), GroundState::kFree);
  EXPECT_EQ(columns.at(4, 5), GroundState::kUnknown);
}

TEST(GroundPlan, WhereSomethingMayHideItIsNotFree) {
  for (const Columns::Height& hidden : {Columns::Height{0.7, 0.75}, {0.1, 0.2}, {1.4, 1.5}}) {
    Columns columns;
    columns.look({{}, {{0, hidden.first}, {hidden.second, 1.6}}});
    EXPECT_EQ(columns.at(), GroundState::kUnknown) << hidden.first;
  }
  Columns columns;
  columns.look({{}, {{0.4, 1.6}}});
  EXPECT_EQ(columns.at(), GroundState::kUnknown) << "a pit?";
}

TEST(GroundPlan, WhatMayHideHalfInOneLayerAndHalfInTheNextIsNotFree) {
  for (const double floor_m : {0.0, 0.0125, 0.025, 0.0375}) {
    Columns columns;
    columns.plan.set_floor({Vec3(0, 0, 1), floor_m, true});
    columns.look({{}, {{0, 0.7}, {0.75, 1.6}}});
    EXPECT_EQ(columns.at(), GroundState::kUnknown) << floor_m;
    columns.look(kNothingThere);
    EXPECT_EQ(columns.at(), GroundState::kFree) << floor_m;
  }
}

TEST(GroundPlan, WhatMayHideAskewIsNotFree) {
  constexpr double kTilt_rad = 0.012;  // over eight cells, half of a part's height
  for (const double floor_m : {0.0, 0.0125, 0.02, 0.025, 0.03}) {
    Columns columns;
    columns.plan.set_floor({Vec3(kTilt_rad, kTilt_rad, 1).normalized(), floor_m, true});
    for (int x = 0; x < 9; ++x)
      for (int y = 0; y < 9; ++y) columns.look({{}, {{-0.1, 0.7}, {0.75, 1.7}}}, x, y);
    EXPECT_EQ(columns.at(), GroundState::kUnknown) << floor_m;
    for (int x = 0; x < 9; ++x)
      for (int y = 0; y < 9; ++y) columns.look({{}, {{-0.1, 1.7}}}, x, y);
    EXPECT_EQ(columns.at(), GroundState::kFree) << floor_m;
  }
}

TEST(GroundPlan, AnObstacleNeedsTwoViewsAndTheHeightOfTheRobot) {
  Columns columns;
  columns.look(kTableTop);
  EXPECT_EQ(columns.at(), GroundState::kUnknown);
  columns.look(kTableTop);
  EXPECT_EQ(columns.at(), GroundState::kOccupied);
  GroundPlanConfig low;
  low.high_m = 0.5;
  Columns below(low);
  for (int i = 0; i < 2; ++i) below.look(kTableTop);
  EXPECT_EQ(below.at(), GroundState::kFree) << "it drives under the table";
  Columns threshold;
  for (int i = 0; i < 2; ++i) threshold.look({{{0.05, 0.1}}, {{0.1, 1.6}}});
  EXPECT_EQ(threshold.at(), GroundState::kFree) << "it drives over a carpet";
  Columns box;
  for (int i = 0; i < 2; ++i) box.look({{{0.1, 0.15}}, {{0.15, 1.6}}});
  EXPECT_EQ(box.at(), GroundState::kOccupied);
}

TEST(GroundPlan, TheLastViewsDecideHoweverLongItStoodThere) {
  for (const int stood : {2, 4, 5, 40}) {
    Columns columns;
    for (int i = 0; i < stood; ++i) columns.look(kTableTop);
    columns.look(kNothingThere);
    if (stood > 4) {
      EXPECT_EQ(columns.at(), GroundState::kOccupied) << "one view may err";
      columns.look(kNothingThere);
    }
    EXPECT_EQ(columns.at(), GroundState::kFree) << stood;
    columns.look(kTableTop);
    EXPECT_EQ(columns.at(), GroundState::kOccupied) << "it is back";
  }
}

TEST(GroundPlan, AViewThatIsPutInAnewBringsBackWhatItShows) {
  Columns columns;
  for (int i = 0; i < 3; ++i) columns.look(kTableTop);
  columns.look(kNothingThere);
  ASSERT_EQ(columns.at(), GroundState::kFree);
  columns.plan.reobserve(Columns::seen_of(kTableTop, 3, 5), {});
  columns.plan.update(columns.space, {});
  EXPECT_EQ(columns.at(), GroundState::kOccupied);
}

TEST(GroundPlan, AViewThatIsPutInAnewBringsNothingBackThatLaterOnesSeeThrough) {
  const SeenSpace top = Columns::seen_of(kTableTop, 3, 5);
  const SeenSpace nothing = Columns::seen_of(kNothingThere, 3, 5);
  const SeenSpace elsewhere = Columns::seen_of(kTableTop, 4, 5);
  using Later = std::vector<const SeenSpace*>;  // the newest first
  for (const auto& [later, expected] :
       {std::pair{Later{&nothing, &nothing, &top}, GroundState::kFree},
        std::pair{Later{&nothing, &elsewhere, &nothing}, GroundState::kFree},
        std::pair{Later{&nothing, &elsewhere}, GroundState::kOccupied},  // one view may err
        std::pair{Later{&nothing, &top, &nothing}, GroundState::kOccupied},
        std::pair{Later{&top, &nothing, &nothing}, GroundState::kOccupied}}) {
    Columns columns;
    for (int i = 0; i < 5; ++i) columns.look(kTableTop);
    for (int i = 0; i < 2; ++i) columns.look(kNothingThere);
    ASSERT_EQ(columns.at(), GroundState::kFree);
    columns.plan.reobserve(top, later);
    columns.plan.update(columns.space, {});
    EXPECT_EQ(columns.at(), expected);
  }
}

TEST(GroundPlan, WhatIsTakenBackIsUnknownAgain) {
  Columns columns;
  columns.look(kNothingThere);
  columns.space.count(Columns::seen_of(kNothingThere, 3, 5), {}, -1, 1);
  columns.plan.update(columns.space, columns.space.take_changed());
  EXPECT_EQ(columns.at(), GroundState::kUnknown);
  EXPECT_EQ(columns.plan.grid().width, 0);
}

TEST(GroundPlan, WithoutAFloorThereIsNone) {
  Columns columns;
  columns.plan = GroundPlan(GroundPlanConfig{});
  columns.look(kNothingThere);
  EXPECT_FALSE(columns.plan.has_floor());
  EXPECT_EQ(columns.plan.grid().width, 0);
  columns.plan.set_floor({Vec3(0, 0, 1), 0, true});
  columns.plan.update(columns.space, {});
  EXPECT_EQ(columns.at(), GroundState::kFree) << "of all that was seen before";
}

TEST(GroundPlan, LaidBitByBitIsLaidAtOnce) {
  Rng rng(7);
  const Gravity askew{Vec3(0.1, -0.2, 1).normalized(), -0.1, true};
  Columns columns;
  columns.plan.set_floor(askew);
  for (int i = 0; i < 300; ++i) {
    const int x = static_cast<int>(rng.below(9)), y = static_cast<int>(rng.below(9)) - 4;
    const double low_m = kSide_m * (static_cast<int>(rng.below(24)) - 4);
    columns.look({{{low_m, low_m + 0.1}}, {{low_m + 0.1, low_m + 1.2}}}, x, y);
  }
  const GroundGrid bit_by_bit = columns.plan.grid();
  EXPECT_GT(std::ranges::count(bit_by_bit.cells, GroundState::kOccupied), 20);
  EXPECT_GT(std::ranges::count(bit_by_bit.cells, GroundState::kUnknown), 20);
  columns.plan.set_floor({Vec3(0, 0, 1), 0, true});
  columns.plan.update(columns.space, {});
  EXPECT_NE(columns.plan.grid().cells, bit_by_bit.cells);
  columns.plan.set_floor(askew);
  columns.plan.update(columns.space, {});
  EXPECT_EQ(columns.plan.grid().cells, bit_by_bit.cells);
  EXPECT_EQ(columns.plan.grid().origin_floor, bit_by_bit.origin_floor);
}

}  // namespace
}  // namespace ygslam
