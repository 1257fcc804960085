#include "dense/space_changes.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace ygslam
