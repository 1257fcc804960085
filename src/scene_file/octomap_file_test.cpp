// Our OctoMap files against those of OctoMap's own library, byte for byte.
#include <gtest/gtest.h>

#include <map>

#include "core/rng.hpp"
#include "io/testing/temp_folder.hpp"
#include "scene/class_colour.hpp"
#include "scene/testing/sample_scene.hpp"
#include "scene_file/space_file.hpp"
#include "scene_file/testing/octomap_trees.hpp"

namespace ygslam {
namespace {

namespace octomap_trees = testing::octomap_trees;

octomap_trees::Leaf leaf_of(const SpaceCell& cell) {
  octomap_trees::Leaf leaf;
  for (int i = 0; i < 3; ++i)
    leaf.key[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(cell.index[i] + 32768);
  leaf.coloured = cell.state == SpaceState::kOccupied;
  leaf.log_odds = leaf.coloured ? std::max(cell.log_odds, 0.0F) : std::min(cell.log_odds, -1e-3F);
  const Rgb8 colour = class_colour(cell.label.semantic_class);
  leaf.rgb = {colour.r, colour.g, colour.b};
  return leaf;
}

std::string by_octomap(decltype(octomap_trees::write_bt) write, const SpaceCells& space) {
  std::string bytes;
  auto next = space.cells.begin();
  const auto leaves = [&](octomap_trees::Leaf& leaf) {
    while (next != space.cells.end() && next->state == SpaceState::kUnknown) ++next;
    if (next == space.cells.end()) return false;
    leaf = leaf_of(*next++);
    return true;
  };
  write(space.cell_m, leaves, [&](std::string_view piece) { bytes += piece; });
  return bytes;
}

void expect_octomaps_bytes(const SpaceCells& space) {
  const testing::TempFolder folder;
  const auto path = folder.path() / "a";
  ASSERT_TRUE(write_octomap_bt(path, space).ok());
  EXPECT_TRUE(testing::read(path) == by_octomap(octomap_trees::write_bt, space));
  ASSERT_TRUE(write_octomap_ot(path, space).ok());
  EXPECT_TRUE(testing::read(path) == by_octomap(octomap_trees::write_ot, space));
}

SpaceCell random_cell(Rng& rng, std::uint32_t unknown_percent, std::uint32_t free_percent) {
  SpaceCell cell;
  if (rng.below(100) < unknown_percent) return cell;
  cell.state = rng.below(100) < free_percent ? SpaceState::kFree : SpaceState::kOccupied;
  constexpr std::array kLogOdds{-9.0F, -2.0F, -0.4F, -0.0F, 0.0F, 0.7F, 3.5F, 9.0F};
  cell.log_odds = rng.below(2) == 0 ? kLogOdds.at(rng.below(kLogOdds.size()))
                                    : static_cast<float>(rng.uniform(-3, 4));
  if (rng.below(4) == 0) {
    cell.colour = {255, 255, 255};
  } else {
    for (std::uint8_t* channel : {&cell.colour.r, &cell.colour.g, &cell.colour.b})
      *channel = static_cast<std::uint8_t>(rng.below(256));
  }
  const auto classes = all_semantic_classes();
  cell.label.semantic_class = classes[rng.below(static_cast<std::uint32_t>(classes.size()))];
  return cell;
}

TEST(OctomapFile, BlocksOfCellsAreWrittenAsOctomapDoes) {
  Rng rng(1);
  for (const std::uint32_t unknown_percent : {0U, 2U, 60U}) {
    for (const std::uint32_t free_percent : {0U, 1U, 50U, 99U, 100U}) {
      SpaceCells space;
      space.cell_m = rng.uniform(0.01, 0.5);
      const Eigen::Vector3i low(-5, -17, -9);  // the blocks lie across the borders of all octants
      for (int z = 0; z < 22; ++z) {
        for (int y = 0; y < 33; ++y) {
          for (int x = 0; x < 25; ++x) {
            space.cells.push_back(random_cell(rng, unknown_percent, free_percent));
            space.cells.back().index = low + Eigen::Vector3i(x, y, z);
          }
        }
      }
      SCOPED_TRACE(std::to_string(unknown_percent) + ", " + std::to_string(free_percent));
      expect_octomaps_bytes(space);
    }
  }
}

TEST(OctomapFile, ScatteredCellsAreWrittenAsOctomapDoes) {
  Rng rng(2);
  for (const std::uint32_t reach : {2U, 300U, 65536U}) {
    std::map<std::array<int, 3>, SpaceCell> cells;  // by (z, y, x)
    const auto coordinate = [&] {
      return static_cast<int>(rng.below(reach)) - static_cast<int>(reach / 2);
    };
    for (int i = 0; i < 5000; ++i) {
      SpaceCell cell = random_cell(rng, 10, 40);
      cell.index = {coordinate(), coordinate(), coordinate()};
      cells[{cell.index.z(), cell.index.y(), cell.index.x()}] = cell;
    }
    SpaceCells space;
    for (const auto& [index, cell] : cells) space.cells.push_back(cell);
    expect_octomaps_bytes(space);
  }
}

TEST(OctomapFile, ARoomIsWrittenAsOctomapDoes) {
  expect_octomaps_bytes(testing::sample_scene(Vec3(0.2, -1, 0.1), 0.05).space);
}

TEST(OctomapFile, TheFarthestCornersAreWrittenAsOctomapDoes) {
  SpaceCells space;
  space.cell_m = 1.0 / 3;
  Rng rng(3);
  for (const int z : {-32768, 32767}) {
    for (const int y : {-32768, 32767}) {
      for (const int x : {-32768, 32767}) {
        space.cells.push_back(random_cell(rng, 0, 50));
        space.cells.back().index = {x, y, z};
        SpaceCells alone{space.cell_m, {space.cells.back()}};
        expect_octomaps_bytes(alone);
      }
    }
  }
  expect_octomaps_bytes(space);
}

TEST(OctomapFile, NothingSeenIsWrittenAsOctomapDoes) {
  SpaceCells space;
  expect_octomaps_bytes(space);
  space.cells.resize(1);  // unknown
  expect_octomaps_bytes(space);
}

TEST(OctomapFile, CellSizesAreWrittenAsOctomapDoes) {
  SpaceCells space;
  space.cells.resize(1);
  space.cells[0].state = SpaceState::kFree;
  for (const double cell_m : {1e-7, 0.05, 0.1 + 0.2, 1.0, 2.5e15}) {
    space.cell_m = cell_m;
    expect_octomaps_bytes(space);
  }
}

}  // namespace
}  // namespace ygslam
