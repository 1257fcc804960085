#include "scene/space_query.hpp"
#include "geometry/random_vector.hpp"

#include <gtest/gtest.h>

#include <random>

namespace ygslam {
namespace {

/// Free cells 0..9 along each axis but a wall at x = 7 and nothing known at x = 4, y > 5.
SpaceCells room() {
  SpaceCells space{0.1, {}};
  for (int z = 0; z < 10; ++z)
    for (int y = 0; y < 10; ++y)
      for (int x = 0; x < 10; ++x) {
        if (x == 4 && y > 5) continue;
        SpaceCell cell;
        cell.index = {x, y, z};
        cell.state = x == 7 ? SpaceState::kOccupied : SpaceState::kFree;
        space.cells.push_back(cell);
      }
  return space;
}

TEST(SpaceQuery, BoxesAreWhatTheWorstOfTheirCellsIs) {
  const SpaceCells space = room();
  EXPECT_EQ(state_of_box(space, {0.1, 0.1, 0.1}, {0.7, 0.5, 0.5}), SpaceState::kFree);
  EXPECT_EQ(state_of_box(space, {0.1, 0.1, 0.1}, {0.71, 0.5, 0.5}), SpaceState::kOccupied);
  EXPECT_EQ(state_of_box(space, {0.1, 0.1, 0.1}, {0.5, 0.65, 0.5}), SpaceState::kUnknown);
  EXPECT_EQ(state_of_box(space, {0.1, 0.1, 0.1}, {0.75, 0.65, 0.5}), SpaceState::kOccupied);
  EXPECT_EQ(state_of_box(space, {-0.05, 0.1, 0.1}, {0.2, 0.2, 0.2}), SpaceState::kUnknown);
  EXPECT_EQ(state_of_box(space, {0.2, 0.2, 0.2}, {0.2, 0.2, 0.2}), SpaceState::kFree);
  EXPECT_EQ(state_at(space, {0.75, 0.1, 0.1}), SpaceState::kOccupied);
  EXPECT_EQ(state_at({}, {0, 0, 0}), SpaceState::kUnknown);
}

TEST(SpaceQuery, RaysEndWhereTheyEnterWhatIsInTheirWay) {
  const SpaceCells space = room();
  const auto cast = [&](const Vec3& from, const Vec3& direction, double length_m, bool past) {
    return cast_ray(space, {from, direction.normalized(), length_m, past});
  };
  SpaceHit hit = cast({0.05, 0.25, 0.55}, {1, 0, 0}, 3, false);
  EXPECT_EQ(hit.what, SpaceState::kOccupied);
  EXPECT_NEAR(hit.distance_m, 0.65, 1e-9);
  hit = cast({0.05, 0.25, 0.55}, {1, 0, 0}, 0.5, false);
  EXPECT_EQ(hit.what, SpaceState::kFree);
  EXPECT_EQ(hit.distance_m, 0.5);
  hit = cast({0.05, 0.75, 0.55}, {1, 0, 0}, 3, false);
  EXPECT_EQ(hit.what, SpaceState::kUnknown);
  EXPECT_NEAR(hit.distance_m, 0.35, 1e-9);
  hit = cast({0.05, 0.75, 0.55}, {1, 0, 0}, 3, true);
  EXPECT_EQ(hit.what, SpaceState::kOccupied);
  EXPECT_NEAR(hit.distance_m, 0.65, 1e-9);
  hit = cast({0.95, 0.25, 0.55}, {-1, 0, 0}, 3, false);
  EXPECT_NEAR(hit.distance_m, 0.15, 1e-9);
  EXPECT_EQ(cast({5, 5, 5}, {0, 0, 1}, 1, false).what, SpaceState::kUnknown);
  EXPECT_EQ(cast({5, 5, 5}, {0, 0, 1}, 1, true).what, SpaceState::kFree);
}

TEST(SpaceQuery, ARayMeetsWhatSmallStepsAlongItMeet) {
  const SpaceCells space = room();
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> inside(0.01, 0.69), any(-1, 1);
  for (int trial = 0; trial < 500; ++trial) {
    const Vec3 from = drawn_vector<Vec3>([&] { return inside(rng); }).cwiseProduct(Vec3(1, 0.7, 1));
    const Vec3 direction = drawn_vector<Vec3>([&] { return any(rng); }).normalized();
    const SpaceHit hit = cast_ray(space, {from, direction, 2, false});
    ASSERT_NE(hit.what, SpaceState::kFree) << "the room is small";
    EXPECT_EQ(state_at(space, from + (hit.distance_m + 1e-6) * direction), hit.what);
    for (double s_m = 0; s_m < hit.distance_m - 1e-6; s_m += 0.003)
      ASSERT_EQ(state_at(space, from + s_m * direction), SpaceState::kFree) << trial;
  }
}

}  // namespace
}  // namespace ygslam
