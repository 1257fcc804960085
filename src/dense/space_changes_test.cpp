#include "dense/space_changes.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "volume/space_scan.hpp"

namespace ygslam {
namespace {

std::vector<SpaceIndex> row(int from, int count) {
  std::vector<SpaceIndex> cells;
  for (int i = 0; i < count; ++i) cells.emplace_back(from + i, 0, 0);
  return cells;
}

TEST(SpaceChanges, OnlyLargePartsCount) {
  std::vector<SpaceIndex> cells = row(-3, 5);
  const auto others = row(4, 4);
  cells.insert(cells.begin() + 2, others.begin(), others.end());
  cells.emplace_back(2, 1, 1);  // touches the first row at a corner
  EXPECT_EQ(in_large_parts(cells, 5).size(), 6U);
  EXPECT_EQ(in_large_parts(cells, 4).size(), 10U);
  EXPECT_TRUE(in_large_parts(cells, 7).empty());
  EXPECT_TRUE(in_large_parts({}, 1).empty());
}

constexpr Timestamp at(double seconds) { return {static_cast<std::int64_t>(seconds * 1e9)}; }

/// A camera before a wall at 2 m, or with a board at 1 m before it.
class Board : public ::testing::Test {
 protected:
  [[nodiscard]] static SeenSpace look(bool board) {
    DepthView view;
    view.camera = {100, 100, 31.5, 23.5, 64, 48};
    view.depth = Image<std::uint16_t>(64, 48);
    view.colour = ColourImage(64, 48);
    view.object = GreyImage(64, 48);
    std::fill(view.depth.begin(), view.depth.end(),
              static_cast<std::uint16_t>(board ? 5000 : 10000));
    PreparedView prepared;
    prepared.assign(view, {});
    return SpaceScan({}, {}).step(prepared, SE3(), 1);
  }
  /// From the newest to the oldest, so far apart.
  void show(std::initializer_list<bool> boards, double step_s) {
    SpaceChanges changes({}, cells_);
    double t_s = 100;
    for (const bool board : boards) changes.step(look(board), at(t_s -= step_s));
    removed_ = changes.removed().size();
    appeared_ = changes.appeared().size();
  }

  std::vector<SpaceIndex> cells_ = cells_where(
      look(true),
      [](const SpaceIndex&, CellObservation seen) { return seen == CellObservation::kHit; });
  std::size_t removed_ = 0, appeared_ = 0;
};

TEST_F(Board, TheLastViewsDecideWhatWent) {
  show({false, false, false, true, true, true, true}, 0.5);
  EXPECT_GT(removed_, cells_.size() / 2);
  EXPECT_EQ(appeared_, 0U);
  show({false, false, true, true, true, true}, 0.5);
  EXPECT_EQ(removed_ + appeared_, 0U) << "two views may be wrong";
  show({false, false, true, false, false, false}, 0.5);
  EXPECT_EQ(removed_ + appeared_, 0U) << "they do not agree";
}

TEST_F(Board, WhatIsAsSmallAsAShoeGoesToo) {
  const SeenSpace wall = look(false);
  std::vector<SpaceIndex> seen_through = cells_;
  std::erase_if(seen_through,
                [&](const SpaceIndex& cell) { return wall.at(cell) != CellObservation::kThrough; });
  const auto gone_of = [&](std::ptrdiff_t count) {  // of the first ones, which are side by side
    SpaceChanges changes({}, {seen_through.begin(), seen_through.begin() + count});
    for (int i = 0; i < 3; ++i) changes.step(wall, at(100 - i));
    return std::ssize(changes.removed());
  };
  EXPECT_EQ(gone_of(6), 6);
  EXPECT_EQ(gone_of(5), 0) << "noise at edges";
}

TEST_F(Board, WhatCameMustStay) {
  show({true, true, true, true, true, false, false}, 0.5);
  EXPECT_EQ(appeared_, cells_.size());
  EXPECT_EQ(removed_, 0U);
  show({true, true, true, true, false, false}, 0.5);
  EXPECT_EQ(appeared_, 0U) << "it stood there for a second and a half";
}

}  // namespace
}  // namespace ygslam
