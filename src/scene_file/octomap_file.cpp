#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <locale>
#include <sstream>

#include "io/piece_file.hpp"
#include "scene/class_colour.hpp"
#include "scene_file/space_file.hpp"

// OctoMap's formats, written without its library: that allocates trees of every type before `main`.
namespace ygslam {
namespace {

constexpr int kTreeDepth = 16;
constexpr int kKeyOffset = 1 << (kTreeDepth - 1);
constexpr Rgb8 kNoColour{255, 255, 255};

struct PlacedCell {
  std::uint64_t path = 0;  ///< from the root down: the child's number at each level, 3 bits
  const SpaceCell* cell = nullptr;
};

std::uint64_t path_to(const Eigen::Vector3i& index) {
  std::uint64_t path = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto key = static_cast<std::uint64_t>(index[axis] + kKeyOffset);
    for (int bit = 0; bit < kTreeDepth; ++bit) path |= (key >> bit & 1) << (3 * bit + axis);
  }
  return path;
}

/// The known cells, the last of a walk through the tree first.
Result<std::vector<PlacedCell>> place_cells(const std::filesystem::path& path,
                                            const SpaceCells& space) {
  std::vector<PlacedCell> placed;
  placed.reserve(space.cells.size());
  for (const SpaceCell& cell : space.cells) {
    if (cell.index.minCoeff() < -kKeyOffset || cell.index.maxCoeff() >= kKeyOffset) {
      return Error{ErrorKind::kOutput, path.string() + ": a cell lies farther out than the " +
                                           std::to_string(kKeyOffset * space.cell_m) +
                                           " m that OctoMap can hold"};
    }
    if (cell.state == SpaceState::kUnknown) continue;
    CHECK(std::isfinite(cell.log_odds), "a cell that is not finite must not be written");
    placed.push_back({path_to(cell.index), &cell});
  }
  std::ranges::sort(placed, std::ranges::greater{}, &PlacedCell::path);
  return placed;
}

/// Walks the tree backwards, so that each node follows its children: in the file, which is written
/// from the end of the walk to its beginning, it stands before them.
/// @param close takes a finished node, its number among the children of its parent, and the parent.
template <typename Node, typename Close>
void walk_tree(const std::vector<PlacedCell>& cells, Node (*leaf_of)(const SpaceCell&),
               Close close) {
  std::array<Node, kTreeDepth + 2> open{};  // by height above the leaves; the last holds the root
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::uint64_t path = cells[i].path;
    std::size_t top = kTreeDepth;  // the highest node without more cells
    if (i + 1 < cells.size()) {
      CHECK(cells[i + 1].path != path, "a cell must not be there twice");
      top = (static_cast<std::size_t>(std::bit_width(path ^ cells[i + 1].path)) - 1) / 3;
    }
    open[0] = leaf_of(*cells[i].cell);
    for (std::size_t height = 0; height <= top; ++height) {
      close(open[height], static_cast<int>(path >> (3 * height) & 7), open[height + 1]);
      open[height] = {};
    }
  }
}

/// Of an OcTree: two bits for each child.
struct StateNode {
  enum Kind : std::uint8_t { kUnknown, kFree, kOccupied, kHasChildren };
  std::uint16_t kinds = 0;
  Kind kind = kHasChildren;
};

StateNode state_leaf(const SpaceCell& cell) {
  return {0, cell.state == SpaceState::kOccupied ? StateNode::kOccupied : StateNode::kFree};
}

/// Of a ColorOcTree, as it stands in the file.
struct ColourRecord {
  float log_odds;
  Rgb8 colour;
  std::uint8_t children;  ///< one bit for each
};
static_assert(sizeof(ColourRecord) == 8);

struct ColourNode {
  float log_odds = std::numeric_limits<float>::lowest();  ///< the highest of the children
  std::array<int, 3> colour_sum{};
  int coloured = 0;
  std::uint8_t children = 0;

  void add_colour(const Rgb8& colour) {
    if (colour == kNoColour) return;
    colour_sum[0] += colour.r;
    colour_sum[1] += colour.g;
    colour_sum[2] += colour.b;
    ++coloured;
  }
  [[nodiscard]] ColourRecord record() const {
    if (coloured == 0) return {log_odds, kNoColour, children};
    const auto mean = [&](std::size_t i) {
      return static_cast<std::uint8_t>(colour_sum[i] / coloured);
    };
    return {log_odds, {mean(0), mean(1), mean(2)}, children};
  }
};

// OctoMap calls occupied what has log-odds of at least 0; the state decides where the two differ.
// Its trees hold no probability outside [0.1192, 0.971].
float log_odds_of_state(const SpaceCell& cell) {
  constexpr float kLowest = -2.00002789F, kBarelyFree = -1e-3F, kHighest = 3.51103067F;
  const bool occupied = cell.state == SpaceState::kOccupied;
  return std::clamp(cell.log_odds, occupied ? 0.0F : kLowest, occupied ? kHighest : kBarelyFree);
}

ColourNode colour_leaf(const SpaceCell& cell) {
  ColourNode leaf;
  leaf.log_odds = log_odds_of_state(cell);
  if (cell.state == SpaceState::kOccupied) leaf.add_colour(class_colour(cell.label.semantic_class));
  return leaf;
}

/// @param records the last first. @param node_count of the tree, leaves among them.
template <typename Record>
Status write_tree(const std::filesystem::path& path, std::string_view kind, std::string_view id,
                  double cell_m, std::size_t node_count, const std::vector<Record>& records) {
  auto file = PieceFile::create(path);
  if (!file.ok()) return file.error();
  std::ostringstream header;
  header.imbue(std::locale::classic());
  header.precision(15);
  header << "# Octomap OcTree " << kind
         << "\n# (feel free to add / change comments, but leave the first line as it is!)\n#\nid "
         << id << "\nsize " << node_count << "\nres " << cell_m << "\ndata\n";
  file->add(header.str());
  for (const Record& record : std::views::reverse(records)) file->add_value(record);
  return file->commit();
}

}  // namespace

Status write_octomap_bt(const std::filesystem::path& path, const SpaceCells& space) {
  CHECK(space.cell_m > 0);
  const auto cells = place_cells(path, space);
  if (!cells.ok()) return cells.error();
  std::vector<std::uint16_t> records;
  std::size_t node_count = cells->empty() ? 0 : 1;
  walk_tree<StateNode>(*cells, state_leaf, [&](StateNode node, int number, StateNode& parent) {
    constexpr unsigned kAllFree = 0x5555, kAllOccupied = 0xAAAA;
    if (node.kinds == kAllFree) node.kind = StateNode::kFree;
    if (node.kinds == kAllOccupied) node.kind = StateNode::kOccupied;
    parent.kinds = static_cast<std::uint16_t>(parent.kinds | node.kind << (2 * number));
    if (node.kind != StateNode::kHasChildren) return;
    records.push_back(node.kinds);
    const unsigned children = (node.kinds | node.kinds >> 1) & kAllFree;
    node_count += static_cast<std::size_t>(std::popcount(children));
  });
  return write_tree(path, "binary file", "OcTree", space.cell_m, node_count, records);
}

Status write_octomap_ot(const std::filesystem::path& path, const SpaceCells& space) {
  CHECK(space.cell_m > 0);
  const auto cells = place_cells(path, space);
  if (!cells.ok()) return cells.error();
  std::vector<ColourRecord> records;
  walk_tree<ColourNode>(
      *cells, colour_leaf, [&](const ColourNode& node, int number, ColourNode& parent) {
        records.push_back(node.record());
        parent.log_odds = std::max(records.back().log_odds, parent.log_odds);
        parent.add_colour(records.back().colour);
        parent.children = static_cast<std::uint8_t>(parent.children | 1 << number);
      });
  return write_tree(path, "file", "ColorOcTree", space.cell_m, records.size(), records);
}

}  // namespace ygslam
