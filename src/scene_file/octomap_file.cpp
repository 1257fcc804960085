#include <algorithm>
#include <limits>

#include "io/piece_file.hpp"
#include "scene/class_colour.hpp"
#include "scene_file/octomap_trees.hpp"
#include "scene_file/space_file.hpp"

namespace ygslam {
namespace {

// OctoMap calls occupied what has log-odds of at least 0; the state decides where the two differ.
float log_odds_of_state(const SpaceCell& cell) {
  CHECK(std::isfinite(cell.log_odds), "a cell that is not finite must not be written");
  constexpr float kBarelyFree = -1e-3F;
  return cell.state == SpaceState::kOccupied ? std::max(cell.log_odds, 0.0F)
                                             : std::min(cell.log_odds, kBarelyFree);
}

octomap_trees::Leaf leaf_of(const SpaceCell& cell, CellColour colour_of) {
  octomap_trees::Leaf leaf;
  for (int i = 0; i < 3; ++i) {
    leaf.key[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(cell.index[i] + 32768);
  }
  leaf.log_odds = log_odds_of_state(cell);
  leaf.coloured = cell.state == SpaceState::kOccupied;
  const Rgb8 colour =
      colour_of == CellColour::kClass ? class_colour(cell.label.semantic_class) : cell.colour;
  leaf.rgb = {colour.r, colour.g, colour.b};
  return leaf;
}

using Writer = void (*)(double, const octomap_trees::LeafSource&, const octomap_trees::ByteSink&);

Status write_tree(const std::filesystem::path& path, const SpaceCells& space, CellColour colour,
                  Writer write) {
  CHECK(space.cell_m > 0);
  for (const SpaceCell& cell : space.cells) {
    if (cell.index.minCoeff() < -32768 || cell.index.maxCoeff() > 32767) {
      return Error{ErrorKind::kOutput, path.string() + ": a cell lies farther out than the " +
                                           std::to_string(32768 * space.cell_m) +
                                           " m that OctoMap can hold"};
    }
  }
  auto file = PieceFile::create(path);
  if (!file.ok()) return file.error();
  auto next = space.cells.begin();
  const auto leaves = [&](octomap_trees::Leaf& leaf) {
    while (next != space.cells.end() && next->state == SpaceState::kUnknown) ++next;
    if (next == space.cells.end()) return false;
    leaf = leaf_of(*next++, colour);
    return true;
  };
  write(space.cell_m, leaves, [&](std::string_view bytes) { file->add(bytes); });
  return file->commit();
}

}  // namespace

Status write_octomap_bt(const std::filesystem::path& path, const SpaceCells& space) {
  return write_tree(path, space, CellColour::kSurface, octomap_trees::write_bt);
}

Status write_octomap_ot(const std::filesystem::path& path, const SpaceCells& space,
                        CellColour colour) {
  return write_tree(path, space, colour, octomap_trees::write_ot);
}

}  // namespace ygslam
