// The map while it runs: Slam::map() and Slam::room().
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "facade/testing/film.hpp"

namespace ygslam::api {
namespace {

using testing::code_of;
using testing::Film;
using testing::film;
using testing::kHeight;
using testing::kNan;
using testing::kWidth;
using testing::settings_for;

/// Of the whole film, which ends where room() is asked.
Room room_of(const Film& seen, const std::map<std::string, std::string>& options = {}) {
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  settings.options.insert(options.begin(), options.end());
  Slam slam = Slam::open(settings);
  for (std::size_t i = 0; i < seen.size(); ++i) slam.process(seen[i]);
  return slam.room();  // outlives it
}

TEST(Room, ARayEndsAtTheSurfaceThatTheCameraSees) {
  const Film& seen = film("static_xyz");
  const Room room = room_of(seen);
  EXPECT_GT(room.t_ns(), 0);
  EXPECT_GT(room.mesh().vertices.size(), 500U);
  EXPECT_EQ(room.mesh().normals.size(), room.mesh().vertices.size());
  EXPECT_GT(room.mesh().triangles.size(), 500U);
  const CameraModel& c = seen.camera;
  int checked = 0, right = 0;
  for (int v = 40; v < kHeight - 40; v += 40) {
    for (int u = 40; u < kWidth - 40; u += 40) {
      const float depth_m = seen[0].depth_m[v * kWidth + u];
      if (!(depth_m > 0.8F && depth_m < 4)) continue;  // farther is not fused
      const std::array<double, 3> along{(u - c.cx) / c.fx, (v - c.cy) / c.fy, 1};
      const double length = std::sqrt(along[0] * along[0] + along[1] * along[1] + 1);
      const RayHit hit = room.ray({0, 0, 0}, along, 10, true);
      const double middle_m = 0.5 * depth_m;
      const bool is_air =
          room.at({along[0] * middle_m, along[1] * middle_m, middle_m}) == Space::kFree;
      right += hit.what == Space::kOccupied && is_air &&
                       std::abs(hit.distance_m - depth_m * length) < 0.2
                   ? 1
                   : 0;
      ++checked;
    }
  }
  EXPECT_GT(checked, 5);
  EXPECT_GE(right, 0.8 * checked) << "of " << checked << ": some pass an edge";
  EXPECT_EQ(room.at({0, 0, -2}), Space::kUnknown) << "behind the camera";
  EXPECT_EQ(room.box({-1, -1, -2}, {1, 1, 3}), Space::kOccupied);
  EXPECT_EQ(room.box({-0.1, -0.1, 0.5}, {0.1, 0.1, 0.6}), Space::kFree);
  EXPECT_EQ(room.box({-0.1, -0.1, -0.6}, {0.1, 0.1, -0.5}), Space::kUnknown);
}

TEST(Room, ItsPlanHasWhatNavigationReads) {
  const Room room = room_of(film("static_xyz"));
  const OccupancyGrid grid = room.occupancy();
  ASSERT_EQ(grid.cells.size(), static_cast<std::size_t>(grid.width) * grid.height);
  EXPECT_EQ(grid.resolution_m, room.cell_m());
  std::map<int, int> count;
  for (const std::int8_t cell : grid.cells) ++count[cell];
  EXPECT_GT(count[100], 10);
  EXPECT_EQ(count[100] + count[0] + count[-1], static_cast<int>(grid.cells.size()));
  int high = 0;
  for (const std::int8_t cell : room.occupancy(1.0, 1.5).cells) high += cell == 100 ? 1 : 0;
  EXPECT_LE(high, count[100]);
  for (const auto& [low_m, high_m] : {std::pair(kNan, 1.0), {1.0, kNan}, {1.0, 0.5}})
    EXPECT_EQ(code_of([&, low_m = low_m, high_m = high_m] { (void)room.occupancy(low_m, high_m); }),
              4);
}

TEST(Room, WhatCannotBeAskedIsCode4) {
  const Room room = room_of(film("static_xyz"));
  EXPECT_EQ(code_of([&] { (void)room.at({kNan, 0, 0}); }), 4);
  EXPECT_EQ(code_of([&] { (void)room.box({0, 0, 0}, {1, kNan, 1}); }), 4);
  EXPECT_EQ(code_of([&] { (void)room.box({0, 0, 0}, {1, -1, 1}); }), 4);
  EXPECT_EQ(code_of([&] { (void)room.box({-900, -900, -900}, {900, 900, 900}); }), 4);
  EXPECT_EQ(code_of([&] { (void)room.ray({0, 0, 0}, {0, 0, 0}); }), 4);
  EXPECT_EQ(code_of([&] { (void)room.ray({0, 0, 0}, {0, 0, kNan}); }), 4);
  EXPECT_EQ(code_of([&] { (void)room.ray({0, 0, 0}, {0, 0, 1}, -1); }), 4);
  EXPECT_EQ(code_of([&] { (void)room.ray({0, 0, 0}, {0, 0, 1}, kNan); }), 4);
  EXPECT_EQ(room.at({1e300, 0, 0}), Space::kUnknown);
  const Room nothing;
  EXPECT_EQ(nothing.t_ns(), 0);
  EXPECT_EQ(nothing.at({0, 0, 0}), Space::kUnknown);
  EXPECT_EQ(nothing.occupancy().cells, std::vector<std::int8_t>{-1});
}

TEST(Room, IsPublishedWhileFramesComeAndStaysAsItWas) {
  const Film& seen = film("static_xyz");
  Settings settings = settings_for(seen);
  settings.room_every_s = 0;
  Slam slam = Slam::open(settings);
  EXPECT_EQ(slam.room().t_ns(), 0);
  slam.process(seen[0]);
  slam.process(seen[1]);  // that nothing rolls shows with the second
  for (int wait = 0; wait < 1000 && slam.room().t_ns() == 0; ++wait)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const Room first = slam.room();
  EXPECT_GE(first.t_ns(), seen[0].t_ns);
  const std::size_t vertices = first.mesh().vertices.size();
  EXPECT_EQ(slam.map().static_map.size(), vertices);
  EXPECT_EQ(slam.map().keyframes.size(), 1U);
  const std::int64_t t_ns = first.t_ns();
  for (std::size_t i = 2; i < seen.size(); ++i) slam.process(seen[i]);
  slam.finish();
  EXPECT_GT(slam.room().t_ns(), first.t_ns()) << "of the end";
  EXPECT_EQ(first.t_ns(), t_ns);
  EXPECT_EQ(first.mesh().vertices.size(), vertices);
  EXPECT_GT(slam.map().keyframes.size(), 1U);
}

TEST(Plan, IsThatOfNowWhereNothingRunsBeside) {
  const Film& seen = film("static_xyz");
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  std::vector<std::int8_t> first;
  for (int run = 0; run < 2; ++run) {
    Slam slam = Slam::open(settings);
    EXPECT_TRUE(slam.plan()->cells.empty());
    EXPECT_EQ(slam.plan()->t_ns, 0);
    for (std::size_t i = 0; i < seen.size(); ++i) slam.process(seen[i]);
    const auto plan = slam.plan();
    ASSERT_EQ(plan->cells.size(), static_cast<std::size_t>(plan->width) * plan->height);
    EXPECT_GT(plan->t_ns, seen[0].t_ns);
    EXPECT_GT(std::ranges::count(plan->cells, 100), 10);
    EXPECT_GT(std::ranges::count(plan->cells, 0), 10);
    EXPECT_EQ(slam.plan(), plan) << "nothing came since";
    if (run == 0) first = plan->cells;
    EXPECT_EQ(plan->cells, first);
    slam.reset();
    EXPECT_TRUE(slam.plan()->cells.empty());
  }
}

TEST(Plan, IsPublishedWithoutWaitingForTheRoom) {
  const Film& seen = film("static_xyz");
  Settings settings = settings_for(seen);
  settings.room_every_s = 1e6;
  Slam slam = Slam::open(settings);
  for (std::size_t i = 0; i < seen.size(); ++i) slam.process(seen[i]);
  for (int wait = 0; wait < 1000 && slam.plan()->cells.empty(); ++wait)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const auto plan = slam.plan();
  EXPECT_FALSE(plan->cells.empty());
  slam.finish();
  EXPECT_GE(slam.plan()->t_ns, plan->t_ns);
}

TEST(Plan, AFloorThatIsGivenIsBelieved) {
  const Film& seen = film("static_xyz");
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  settings.floor = Floor{{0, -2, 0}, -0.9};
  Slam slam = Slam::open(settings);
  for (std::size_t i = 0; i < seen.size(); ++i) slam.process(seen[i]);
  const Pose& T_world_floor = slam.plan()->T_world_floor;
  EXPECT_NEAR(T_world_floor.translation_m[1], 0.9, 1e-9);
  EXPECT_NEAR(T_world_floor.translation_m[2], 0, 1e-9);
  for (const Floor& wrong : {Floor{{0, 0, 0}, 1}, Floor{{0, kNan, 1}, 1}, Floor{{0, -1, 0}, kNan},
                             Floor{{1e200, 0, 0}, 1}}) {
    settings.floor = wrong;
    EXPECT_EQ(code_of([&] { Slam::open(settings); }), 3);
  }
}

TEST(Room, IsForgottenByAReset) {
  const Film& seen = film("static_xyz");
  for (const bool deterministic : {false, true}) {
    Settings settings = settings_for(seen);
    settings.deterministic = deterministic;
    settings.room_every_s = 0;
    Slam slam = Slam::open(settings);
    for (std::size_t i = 0; i < 5; ++i) slam.process(seen[i]);
    slam.reset();
    EXPECT_EQ(slam.room().t_ns(), 0);
    EXPECT_TRUE(slam.map().keyframes.empty());
    EXPECT_TRUE(slam.map().static_map.empty());
  }
  Settings settings = settings_for(seen);
  settings.room_every_s = kNan;
  EXPECT_EQ(code_of([&] { Slam::open(settings); }), 3);
}

}  // namespace
}  // namespace ygslam::api
