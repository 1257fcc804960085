#include "scene_file/space_file.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "io/testing/temp_folder.hpp"
#include "scene/class_colour.hpp"
#include "scene/testing/sample_scene.hpp"

namespace ygslam {
namespace {

using testing::read;
using testing::sample_scene;

using Index = std::array<int, 3>;
struct FoundLeaf {
  bool occupied = false;
  float log_odds = 0;
  Rgb8 colour;
};
using Leaves = std::map<Index, FoundLeaf>;

// Reads OctoMap's trees as its file formats are described, cutting pruned leaves into cells.
class TreeParser {
 public:
  TreeParser(const std::string& bytes, bool binary) : bytes_(bytes) {
    at_ = bytes.find("\ndata\n") + 6;
    if (bytes.find("\nsize 0\n") != std::string::npos) return;
    const Index root{-32768, -32768, -32768};
    if (binary) {
      parse_binary(root, 1 << 16);
    } else {
      parse_full(root, 1 << 16);
    }
  }
  [[nodiscard]] const Leaves& leaves() const { return leaves_; }
  [[nodiscard]] bool at_end() const { return at_ == bytes_.size(); }

 private:
  void parse_binary(const Index& low, int side) {
    const auto kinds = static_cast<std::uint8_t>(bytes_.at(at_)) |
                       static_cast<std::uint8_t>(bytes_.at(at_ + 1)) << 8;
    at_ += 2;
    for (int child = 0; child < 8; ++child) {  // bits: 1 free, 2 occupied, 3 has children
      const int kind = kinds >> (2 * child) & 3;
      if (kind == 1 || kind == 2) add(child_of(low, side, child), side / 2, {kind == 2, 0, {}});
    }
    for (int child = 0; child < 8; ++child)
      if ((kinds >> (2 * child) & 3) == 3) parse_binary(child_of(low, side, child), side / 2);
  }
  void parse_full(const Index& low, int side) {
    FoundLeaf leaf;
    std::memcpy(&leaf.log_odds, bytes_.data() + at_, 4);
    std::memcpy(&leaf.colour, bytes_.data() + at_ + 4, 3);
    leaf.occupied = leaf.log_odds >= 0;
    const int children = static_cast<std::uint8_t>(bytes_.at(at_ + 7));
    at_ += 8;
    if (children == 0) add(low, side, leaf);
    for (int child = 0; child < 8; ++child)
      if (children >> child & 1) parse_full(child_of(low, side, child), side / 2);
  }
  static Index child_of(const Index& low, int side, int child) {
    return {low[0] + (child & 1) * side / 2, low[1] + (child >> 1 & 1) * side / 2,
            low[2] + (child >> 2 & 1) * side / 2};
  }
  void add(const Index& low, int side, const FoundLeaf& leaf) {
    for (int z = 0; z < side; ++z)
      for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) leaves_[{low[0] + x, low[1] + y, low[2] + z}] = leaf;
  }

  const std::string& bytes_;
  std::size_t at_ = 0;
  Leaves leaves_;
};

Index index_of(const SpaceCell& cell) { return {cell.index.x(), cell.index.y(), cell.index.z()}; }

TEST(SpaceFile, OctomapHasEveryKnownCellAndNoOther) {
  const testing::TempFolder folder;
  const SpaceCells space = sample_scene(Vec3(0.2, -1, 0.1)).space;
  ASSERT_TRUE(write_octomap_bt(folder.path() / "a.bt", space).ok());
  ASSERT_TRUE(write_octomap_ot(folder.path() / "a.ot", space).ok());
  const std::string bt = read(folder.path() / "a.bt"), ot = read(folder.path() / "a.ot");
  EXPECT_EQ(bt.find("# Octomap OcTree binary file\n"), 0U);
  EXPECT_NE(bt.find("\nid OcTree\n"), std::string::npos);
  EXPECT_NE(ot.find("\nid ColorOcTree\n"), std::string::npos);
  EXPECT_NE(ot.find("\nres 0.1\n"), std::string::npos);
  const TreeParser binary(bt, true), full(ot, false);
  EXPECT_TRUE(binary.at_end() && full.at_end());

  std::size_t known = 0, unknown = 0;
  for (const SpaceCell& cell : space.cells) {
    if (cell.state == SpaceState::kUnknown) {
      ++unknown;
      ASSERT_FALSE(binary.leaves().contains(index_of(cell)) ||
                   full.leaves().contains(index_of(cell)));
      continue;
    }
    ++known;
    const bool occupied = cell.state == SpaceState::kOccupied;
    ASSERT_EQ(binary.leaves().at(index_of(cell)).occupied, occupied);
    const FoundLeaf leaf = full.leaves().at(index_of(cell));
    ASSERT_EQ(leaf.occupied, occupied);
    ASSERT_EQ(leaf.log_odds, cell.log_odds);
    if (!occupied) continue;
    ASSERT_EQ(leaf.colour, class_colour(cell.label.semantic_class));
  }
  EXPECT_EQ(binary.leaves().size(), known);
  EXPECT_EQ(full.leaves().size(), known);
  EXPECT_GT(unknown, 100U);
}

TEST(SpaceFile, TheStateDecidesWhatIsOccupied) {
  const testing::TempFolder folder;
  SpaceCells space;
  space.cells.resize(2);
  space.cells[0].state = SpaceState::kFree;
  space.cells[1].state = SpaceState::kOccupied;
  space.cells[1].index.z() = 1;
  for (SpaceCell& cell : space.cells)
    cell.log_odds = cell.state == SpaceState::kFree ? 0.5F : -0.5F;
  ASSERT_TRUE(write_octomap_ot(folder.path() / "a.ot", space).ok());
  const std::string bytes = read(folder.path() / "a.ot");
  const TreeParser tree(bytes, false);
  EXPECT_FALSE(tree.leaves().at({0, 0, 0}).occupied);
  EXPECT_TRUE(tree.leaves().at({0, 0, 1}).occupied);
}

TEST(SpaceFile, ACellBeyondOctomapsReachIsRefused) {
  const testing::TempFolder folder;
  SpaceCells space;
  space.cells.resize(1);
  space.cells[0].state = SpaceState::kFree;
  for (const int far : {-32768, 32767}) {
    space.cells[0].index.y() = far;
    EXPECT_TRUE(write_octomap_bt(folder.path() / "a.bt", space).ok());
    space.cells[0].index.y() += far < 0 ? -1 : 1;
    const Status refused = write_octomap_bt(folder.path() / "a.bt", space);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().kind, ErrorKind::kOutput);
    EXPECT_NE(refused.error().message.find("a.bt: a cell lies farther out"), std::string::npos);
    EXPECT_FALSE(write_octomap_ot(folder.path() / "a.ot", space).ok());
  }
}

}  // namespace
}  // namespace ygslam
