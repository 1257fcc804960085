#include "scene/scene.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

TEST(SpaceCells, AirIsWhereItWasSeen) {
  SpaceCells space;
  space.cell_m = 0.1;
  const auto add = [&](int x, int y, int z, SpaceState state) {
    space.cells.push_back({{x, y, z}, state, 0, {}, {}});
  };
  add(3, 2, -1, SpaceState::kFree);
  add(-1, 0, 0, SpaceState::kFree);
  add(0, 0, 0, SpaceState::kOccupied);
  add(0, 1, 0, SpaceState::kFree);
  EXPECT_TRUE(is_free(space, {0.35, 0.25, -0.05}));
  EXPECT_TRUE(is_free(space, {-0.01, 0.09, 0.0}));
  EXPECT_FALSE(is_free(space, {0.05, 0.05, 0.05})) << "occupied";
  EXPECT_TRUE(is_free(space, {0.0, 0.1, 0.0})) << "a cell's lower bound is its own";
  EXPECT_FALSE(is_free(space, {0.1, 0.1, 0.0})) << "its upper is not";
  EXPECT_FALSE(is_free(space, {0.35, 0.25, 0.05})) << "unknown";
  EXPECT_FALSE(is_free({}, {0, 0, 0}));
}

}  // namespace
}  // namespace ygslam
