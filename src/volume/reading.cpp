#include "volume/reading.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace ygslam {
namespace {

// Pixels that hit a cell need not fall on a voxel in it: then its neighbours are asked [voxels].
constexpr int kBeside = 2;

/// Gives a cell the colour and label of the voxel nearest to the surface among those whose centre
/// lies in it or at most `around` voxels beside. @return whether there is one.
bool colour_cell(const SurfaceLayer& layer, double cell_m, int around, SpaceCell& cell) {
  const double voxel_m = layer.config().voxel_m;
  const auto first_voxel = [&](int index) {
    return static_cast<int>(std::ceil(index * cell_m / voxel_m - 0.5));
  };
  const Eigen::Vector3i low = cell.index.unaryExpr(first_voxel).array() - around;
  const Eigen::Vector3i high =
      (cell.index + Eigen::Vector3i::Ones()).unaryExpr(first_voxel).array() + around;
  float nearest_m = std::numeric_limits<float>::infinity();
  for (int z = low.z(); z < high.z(); ++z) {
    for (int y = low.y(); y < high.y(); ++y) {
      for (int x = low.x(); x < high.x(); ++x) {
        const std::optional<Voxel> voxel = layer.voxel({x, y, z});
        if (!voxel || std::abs(voxel->distance_m) >= nearest_m) continue;
        nearest_m = std::abs(voxel->distance_m);
        cell.colour = voxel->colour;
        cell.label = voxel->label;
      }
    }
  }
  return nearest_m < std::numeric_limits<float>::infinity();
}

}  // namespace

SpaceCells space_cells(const Volume& volume, const ReadingConfig& config) {
  const SpaceLayer& space = volume.space();
  SpaceCells result;
  result.cell_m = space.config().cell_m;
  for (const BlockKey key : space.blocks().keys()) {
    const SpaceBlock& block = *space.blocks().find(key);
    const Eigen::Vector3i first = block_of(key) * kBlockSide;
    for (int offset = 0; offset < kBlockCells; ++offset) {
      const auto i = static_cast<std::size_t>(offset);
      const SpaceCounts counts{block.hits[i], block.through[i]};
      SpaceCell cell;
      cell.state = counts.state();
      if (cell.state == SpaceState::kUnknown) continue;
      if (cell.state == SpaceState::kOccupied && counts.hits < config.min_views) continue;
      cell.index = first + Eigen::Vector3i(offset % 8, offset / 8 % 8, offset / 64);
      cell.log_odds = counts.log_odds();
      if (cell.state == SpaceState::kOccupied &&
          !colour_cell(volume.surface(), result.cell_m, 0, cell))
        colour_cell(volume.surface(), result.cell_m, kBeside, cell);
      result.cells.push_back(cell);
    }
  }
  std::sort(result.cells.begin(), result.cells.end(), [](const SpaceCell& a, const SpaceCell& b) {
    return std::tie(a.index.z(), a.index.y(), a.index.x()) <
           std::tie(b.index.z(), b.index.y(), b.index.x());
  });
  return result;
}

}  // namespace ygslam
