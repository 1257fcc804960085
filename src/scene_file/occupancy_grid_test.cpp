#include "scene_file/occupancy_grid.hpp"

#include <gtest/gtest.h>

#include "io/testing/temp_folder.hpp"
#include "scene/testing/sample_scene.hpp"

namespace ygslam {
namespace {

using testing::read;
using testing::sample_scene;
using testing::SampleBox;
using testing::SampleScene;

SpaceCell cell_at(int x, int y, int z, SpaceState state,
                  SemanticClass semantic_class = SemanticClass::kUnknown) {
  SpaceCell cell;
  cell.index = {x, y, z};
  cell.state = state;
  cell.label.semantic_class = semantic_class;
  return cell;
}

OccupancyGrid grid_of(const std::vector<SpaceCell>& cells, const Gravity& gravity = {}) {
  auto grid = make_occupancy_grid({0.05, cells}, gravity);
  EXPECT_TRUE(grid.ok());
  return std::move(*grid);
}

// Shade at a point of the floor [m]; unknown outside of the picture.
std::uint8_t shade_at(const OccupancyGrid& grid, double x_m, double y_m) {
  const Vec2 p = (Vec2(x_m, y_m) - grid.origin_floor) / grid.resolution_m;
  const int u = static_cast<int>(std::floor(p.x()));
  const int v = grid.shades.height() - 1 - static_cast<int>(std::floor(p.y()));
  return grid.shades.contains(u, v) ? grid.shades.at(u, v) : kGridUnknown;
}

TEST(OccupancyGrid, TheFirstRowHasTheLargestY) {
  const OccupancyGrid grid =
      grid_of({cell_at(-2, -1, 10, SpaceState::kOccupied), cell_at(3, 4, 0, SpaceState::kFree)});
  EXPECT_EQ(grid.shades.width(), 6);
  EXPECT_EQ(grid.shades.height(), 6);
  EXPECT_EQ(grid.shades.at(0, 5), kGridOccupied);
  EXPECT_EQ(grid.shades.at(5, 0), kGridFree);
  EXPECT_EQ(grid.shades.at(3, 3), kGridUnknown);
  EXPECT_NEAR((grid.origin_floor - Vec2(-0.1, -0.05)).norm(), 0, 1e-12);
}

TEST(OccupancyGrid, HeightAndClassDecideWhatIsInTheWay) {
  const auto occupied = SpaceState::kOccupied;
  const auto shade_of = [](const SpaceCell& cell, double floor_m = 0) {
    return grid_of({cell}, {Vec3(0, 0, 1), floor_m}).shades.at(0, 0);
  };
  EXPECT_EQ(shade_of(cell_at(0, 0, 0, occupied)), kGridFree) << "the floor, or a carpet on it";
  EXPECT_EQ(shade_of(cell_at(0, 0, 2, occupied)), kGridOccupied) << "10 cm: a threshold";
  EXPECT_EQ(shade_of(cell_at(0, 0, 3, occupied, SemanticClass::kFloor)), kGridFree) << "bumpy";
  EXPECT_EQ(shade_of(cell_at(0, 0, 20, occupied, SemanticClass::kFloor)), kGridOccupied);
  EXPECT_EQ(shade_of(cell_at(0, 0, 29, occupied)), kGridOccupied);
  EXPECT_EQ(shade_of(cell_at(0, 0, 20, occupied, SemanticClass::kCeiling)), kGridUnknown);
  EXPECT_EQ(shade_of(cell_at(0, 0, 31, occupied)), kGridUnknown) << "a lamp";
  EXPECT_EQ(shade_of(cell_at(0, 0, 3, SpaceState::kFree)), kGridFree);
  EXPECT_EQ(shade_of(cell_at(0, 0, 12, SpaceState::kFree)), kGridUnknown)
      << "air over who knows what";
  EXPECT_EQ(shade_of(cell_at(0, 0, 3, SpaceState::kUnknown)), kGridUnknown);
  EXPECT_EQ(shade_of(cell_at(0, 0, -10, occupied)), kGridUnknown) << "a pit";
  EXPECT_EQ(shade_of(cell_at(0, 0, 20, occupied), 0.95), kGridFree) << "the floor of this room";
}

TEST(OccupancyGrid, WhatIsInTheWayWinsOverTheFloorUnderIt) {
  for (const bool floor_first : {false, true}) {
    std::vector<SpaceCell> cells{cell_at(0, 0, 0, SpaceState::kOccupied, SemanticClass::kFloor),
                                 cell_at(0, 0, 14, SpaceState::kOccupied)};
    if (!floor_first) std::swap(cells[0], cells[1]);
    EXPECT_EQ(grid_of(cells).shades.at(0, 0), kGridOccupied);
  }
}

TEST(OccupancyGrid, NothingKnownIsOneUnknownPixel) {
  const OccupancyGrid grid = grid_of({});
  EXPECT_EQ(grid.shades.size(), 1U);
  EXPECT_EQ(grid.shades.at(0, 0), kGridUnknown);
}

TEST(OccupancyGrid, APlanThatWouldNotFitIsRefused) {
  const SpaceCells space{
      0.05, {cell_at(-30'000, 0, 1, SpaceState::kFree), cell_at(0, 30'000, 1, SpaceState::kFree)}};
  const auto grid = make_occupancy_grid(space, {});
  ASSERT_FALSE(grid.ok());
  EXPECT_EQ(grid.error().kind, ErrorKind::kOutput);
  EXPECT_NE(grid.error().message.find("30001 x 30001 pixels"), std::string::npos);
}

// However the room stands in the world, the plan is that of the room.
TEST(OccupancyGrid, ARoomAtAnyAngleKeepsItsPlan) {
  for (const Vec3& up :
       {Vec3(0, 0, 1), Vec3(0, -1, 0), Vec3(1, 0, 0), Vec3(0.02, -1, 0.04), Vec3(0.3, -1, 0.5)}) {
    const SampleScene scene = sample_scene(up, 0.05);
    const auto grid = make_occupancy_grid(scene.space, scene.gravity);
    ASSERT_TRUE(grid.ok());
    const SE3 T_floor_room = grid->T_world_floor.inverse() * scene.T_world_room;
    const auto boxes = testing::sample_boxes();
    int wrong = 0, seen = 0;
    for (double x = -0.6; x < 2.6; x += 0.02) {
      for (double y = -0.6; y < 2.2; y += 0.02) {
        // Well inside of an area: cells that stand askew blur its edge by half their diagonal.
        const auto inside = [&](const SampleBox& box, double margin_m) {
          return x > box.low.x() + margin_m && x < box.high.x() - margin_m &&
                 y > box.low.y() + margin_m && y < box.high.y() - margin_m;
        };
        const Vec3 p = T_floor_room * Vec3(x, y, 0);
        const std::uint8_t shade = shade_at(*grid, p.x(), p.y());
        const bool hidden = inside(testing::kSampleHidden, -0.1);
        const bool in_the_way = inside(boxes[3], 0.1) || inside(boxes[4], 0.1);
        const bool near = inside(boxes[3], -0.1) || inside(boxes[4], -0.1) ||
                          inside(boxes[5], -0.1) || inside(boxes[1], -0.1) || hidden;
        if (in_the_way) wrong += shade != kGridOccupied;
        const bool on_the_floor = inside(boxes[0], 0.1) && !near;
        if (on_the_floor) wrong += shade != kGridFree;
        const bool outside = !inside({{}, {}, Vec3(0, 0, 0), Vec3(2, 1.6, 0)}, -0.1);
        if (outside || inside(testing::kSampleHidden, 0.1)) wrong += shade != kGridUnknown;
        seen += in_the_way || on_the_floor;
      }
    }
    EXPECT_EQ(wrong, 0) << up.transpose();
    EXPECT_GT(seen, 1000);
  }
}

TEST(OccupancyGrid, FilesAreMapServers) {
  const testing::TempFolder folder;
  const OccupancyGrid grid =
      grid_of({cell_at(-2, -1, 10, SpaceState::kOccupied), cell_at(0, 0, 0, SpaceState::kFree)});
  ASSERT_TRUE(write_occupancy_grid(folder.path() / "my: plan.yaml", grid).ok());
  EXPECT_EQ(read(folder.path() / "my: plan.pgm"),
            std::string("P5\n3 2\n255\n\xCD\xCD\xFE\x00\xCD\xCD", 17));
  EXPECT_EQ(read(folder.path() / "my: plan.yaml"),
            "image: \"my: plan.pgm\"\nmode: trinary\nresolution: 0.05\norigin: [-0.1, -0.05, 0]\n"
            "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
            "# Pose of this grid's frame (z up, floor at 0) in the world of the other files.\n"
            "world_from_map:\n  translation_m: [0, 0, 0]\n  rotation_xyzw: [0, 0, 0, 1]\n");
}

}  // namespace
}  // namespace ygslam
