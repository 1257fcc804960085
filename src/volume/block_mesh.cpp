#include "volume/block_mesh.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "volume/marching_cubes.hpp"

namespace ygslam {
namespace {

constexpr int kSide = kBlockSide + 1;  // voxels along a row of cubes
// Voxels of one cube differ in distance by at most its diagonal; where two bands meet back to
// back they differ by the width of a band.
constexpr float kMostDifference_voxels = 4;

/// A block and its 26 neighbours.
class Neighbourhood {
 public:
  Neighbourhood(const SurfaceLayer& layer, BlockKey key, int min_views)
      : min_views_(min_views), quantum_m_(static_cast<float>(layer.quantum_m())) {
    const Eigen::Vector3i middle = block_of(key);
    for (int i = 0; i < 27; ++i) {
      const Eigen::Vector3i step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      blocks_[static_cast<std::size_t>(i)] = layer.blocks().find(block_key(middle + step));
    }
  }

  /// @param x, y, z from -8 to 15, counted from the middle block's first voxel.
  [[nodiscard]] const SurfaceBlock* block(int x, int y, int z) const {
    const int i = ((z >> 3) + 1) * 9 + ((y >> 3) + 1) * 3 + (x >> 3) + 1;
    return blocks_[static_cast<std::size_t>(i)];
  }
  /// The mean signed distance [m]; NaN where too few views saw the voxel.
  [[nodiscard]] float distance_m(int x, int y, int z) const {
    const SurfaceBlock* found = block(x, y, z);
    if (found == nullptr) return kNan;
    const VoxelPlace place = voxel_place(x & 7, y & 7, z & 7);
    const SurfaceBrick* brick = found->bricks[place.brick];
    return brick == nullptr ? kNan : mean(*brick, place.voxel);
  }
  [[nodiscard]] float mean(const SurfaceBrick& brick, int voxel) const {
    const auto i = static_cast<std::size_t>(voxel);
    if (brick.views[i] < min_views_) return kNan;
    return static_cast<float>(brick.weighted_distance[i]) / static_cast<float>(brick.weight[i]) *
           quantum_m_;
  }

 private:
  static constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  std::array<const SurfaceBlock*, 27> blocks_{};
  int min_views_;
  float quantum_m_;
};

/// Distances of the voxels at the corners of the block's cubes, and by row along x which are
/// believed and which lie behind the surface.
struct CubeCorners {
  std::array<float, kSide * kSide * kSide> distance_m;
  std::array<std::uint16_t, kSide * kSide> valid{}, inside{};

  [[nodiscard]] static std::size_t row(int y, int z) {
    return static_cast<std::size_t>(z * kSide + y);
  }
  [[nodiscard]] float at(int x, int y, int z) const {
    return distance_m[row(y, z) * kSide + static_cast<std::size_t>(x)];
  }

  explicit CubeCorners(const Neighbourhood& around) {
    for (int z = 0; z < kSide; ++z) {
      for (int y = 0; y < kSide; ++y) {
        float* to = distance_m.data() + row(y, z) * kSide;
        unsigned is_valid = 0, is_inside = 0;
        const auto put = [&](int x, float value) {
          to[x] = value;
          is_valid |= static_cast<unsigned>(value == value) << x;
          is_inside |= static_cast<unsigned>(value < 0) << x;
        };
        if (const SurfaceBlock* block = around.block(0, y, z)) {
          for (int half = 0; half < 2; ++half) {
            const VoxelPlace place = voxel_place(kBrickSide * half, y & 7, z & 7);
            const SurfaceBrick* brick = block->bricks[place.brick];
            if (brick == nullptr) continue;
            for (int x = 0; x < kBrickSide; ++x)
              put(kBrickSide * half + x, around.mean(*brick, place.voxel + x));
          }
        }
        put(kBlockSide, around.distance_m(kBlockSide, y, z));
        valid[row(y, z)] = static_cast<std::uint16_t>(is_valid);
        inside[row(y, z)] = static_cast<std::uint16_t>(is_inside);
      }
    }
  }
  [[nodiscard]] bool has_crossing() const {
    unsigned any_inside = 0, any_outside = 0;
    for (std::size_t i = 0; i < valid.size(); ++i) {
      any_inside |= inside[i];
      any_outside |= valid[i] & ~static_cast<unsigned>(inside[i]);
    }
    return any_inside != 0 && any_outside != 0;
  }
};

class BlockMesher {
 public:
  BlockMesher(const SurfaceLayer& layer, const Neighbourhood& around, const CubeCorners& corners)
      : voxel_m_(static_cast<float>(layer.config().voxel_m)), around_(around), corners_(corners) {}

  BlockMesh mesh() && {
    for (int z = 0; z < kBlockSide; ++z)
      for (int y = 0; y < kBlockSide; ++y) {
        add_vertices(y, z);
        add_triangles(y, z);
      }
    return std::move(mesh_);
  }

 private:
  void add_vertices(int y, int z) {
    const auto crossed = [&](unsigned inside, unsigned valid, std::size_t other, int shift) {
      return (inside ^ (static_cast<unsigned>(corners_.inside[other]) >> shift)) & valid &
             (static_cast<unsigned>(corners_.valid[other]) >> shift) & 0xffU;
    };
    const std::size_t here = CubeCorners::row(y, z);
    const unsigned inside = corners_.inside[here];
    const unsigned valid = corners_.valid[here];
    const std::array<unsigned, 3> along{crossed(inside, valid, here, 1),
                                        crossed(inside, valid, CubeCorners::row(y + 1, z), 0),
                                        crossed(inside, valid, CubeCorners::row(y, z + 1), 0)};
    for (unsigned left = along[0] | along[1] | along[2]; left != 0; left &= left - 1) {
      const int x = std::countr_zero(left);
      for (int axis = 0; axis < 3; ++axis)
        if (along[static_cast<std::size_t>(axis)] >> x & 1U) add_vertex({x, y, z}, axis);
    }
  }

  void add_vertex(const Eigen::Vector3i& voxel, int axis) {
    const Eigen::Vector3i upper = voxel + Eigen::Vector3i::Unit(axis);
    const float a = corners_.at(voxel.x(), voxel.y(), voxel.z());
    const float b = corners_.at(upper.x(), upper.y(), upper.z());
    const float fraction = a / (a - b);
    BlockVertex vertex;
    vertex.edge =
        static_cast<std::uint16_t>(3 * cell_offset(voxel.x(), voxel.y(), voxel.z()) + axis);
    vertex.fraction = static_cast<std::uint16_t>(std::lround(fraction * 65535.0F));
    const Eigen::Vector3f gradient =
        (1 - fraction) * gradient_at(voxel, a) + fraction * gradient_at(upper, b);
    const float length = gradient.norm();
    for (int i = 0; i < 3; ++i)
      vertex.normal_world[static_cast<std::size_t>(i)] =
          static_cast<std::int16_t>(length > 0 ? std::lround(gradient[i] / length * 32767.0F) : 0);
    const VoxelPlace lower_place = voxel_place(voxel.x(), voxel.y(), voxel.z());
    const VoxelPlace upper_place = voxel_place(upper.x() & 7, upper.y() & 7, upper.z() & 7);
    const SurfaceBlock& upper_block = *around_.block(upper.x(), upper.y(), upper.z());
    const SurfaceBlock& lower_block = *around_.block(voxel.x(), voxel.y(), voxel.z());
    const SurfaceBrick& lower_brick = *lower_block.bricks[lower_place.brick];
    const SurfaceBrick& upper_brick = *upper_block.bricks[upper_place.brick];
    const int lower_views = lower_brick.views[static_cast<std::size_t>(lower_place.voxel)];
    const int upper_views = upper_brick.views[static_cast<std::size_t>(upper_place.voxel)];
    const Rgb8 first = lower_brick.mean_colour(lower_place.voxel);
    const Rgb8 second = upper_brick.mean_colour(upper_place.voxel);
    const auto mixed = [&](std::uint8_t p, std::uint8_t q) {
      const float value = (1 - fraction) * static_cast<float>(p) + fraction * static_cast<float>(q);
      return static_cast<std::uint8_t>(value + 0.5F);
    };
    vertex.colour = {mixed(first.r, second.r), mixed(first.g, second.g), mixed(first.b, second.b)};
    const SurfaceLabel label =
        fraction < 0.5F
            ? lower_block.label(cell_offset(voxel.x(), voxel.y(), voxel.z()), lower_views)
            : upper_block.label(cell_offset(upper.x() & 7, upper.y() & 7, upper.z() & 7),
                                upper_views);
    vertex.object = label.object;
    vertex.probability = static_cast<std::uint8_t>(label.probability * 255.0F + 0.5F);
    vertex.views = static_cast<std::uint16_t>(std::min(lower_views, upper_views));
    mesh_.vertices.push_back(vertex);
  }

  /// From the neighbours on both sides, or on one where the other is unknown.
  [[nodiscard]] Eigen::Vector3f gradient_at(const Eigen::Vector3i& voxel, float here) const {
    Eigen::Vector3f gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3i step = Eigen::Vector3i::Unit(axis);
      const float before =
          around_.distance_m(voxel.x() - step.x(), voxel.y() - step.y(), voxel.z() - step.z());
      const float after =
          around_.distance_m(voxel.x() + step.x(), voxel.y() + step.y(), voxel.z() + step.z());
      const bool has_before = before == before;
      const bool has_after = after == after;
      gradient[axis] = has_before && has_after ? 0.5F * (after - before)
                       : has_after             ? after - here
                       : has_before            ? here - before
                                               : 0.0F;
    }
    return gradient;
  }

  void add_triangles(int y, int z) {
    const std::array<std::size_t, 4> rows{CubeCorners::row(y, z), CubeCorners::row(y + 1, z),
                                          CubeCorners::row(y, z + 1),
                                          CubeCorners::row(y + 1, z + 1)};
    unsigned valid = 0xffffU, any = 0, all = 0xffffU;
    for (const std::size_t row : rows) {
      valid &= corners_.valid[row];
      any |= corners_.inside[row];
      all &= corners_.inside[row];
    }
    valid &= valid >> 1;
    any |= any >> 1;
    all &= all >> 1;
    for (unsigned left = valid & any & ~all & 0xffU; left != 0; left &= left - 1) {
      const int x = std::countr_zero(left);
      if (spread_m(x, y, z) > kMostDifference_voxels * voxel_m_) continue;
      unsigned inside = 0;
      for (std::size_t i = 0; i < rows.size(); ++i)
        inside |= (static_cast<unsigned>(corners_.inside[rows[i]]) >> x & 3U) << (2 * i);
      for (const auto& corners : cube_triangles(static_cast<std::uint8_t>(inside))) {
        std::array<std::uint16_t, 3> triangle{};
        for (std::size_t i = 0; i < 3; ++i) triangle[i] = code(x, y, z, corners[i]);
        mesh_.triangles.push_back(triangle);
      }
    }
  }

  [[nodiscard]] float spread_m(int x, int y, int z) const {
    float low = corners_.at(x, y, z), high = low;
    for (int c = 1; c < 8; ++c) {
      const float value = corners_.at(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
      low = std::min(low, value);
      high = std::max(high, value);
    }
    return high - low;
  }

  [[nodiscard]] static std::uint16_t code(int x, int y, int z, CubeEdge edge) {
    const int corner = edge / 3;
    const int vx = x + (corner & 1), vy = y + (corner >> 1 & 1), vz = z + (corner >> 2);
    const int offset = (vx >> 3) | (vy >> 3) << 1 | (vz >> 3) << 2;
    return static_cast<std::uint16_t>((3 * cell_offset(vx & 7, vy & 7, vz & 7) + edge % 3) |
                                      offset << 11);
  }

  float voxel_m_;
  const Neighbourhood& around_;
  const CubeCorners& corners_;
  BlockMesh mesh_;
};

}  // namespace

SurfacePoint BlockVertex::point(const Eigen::Vector3i& block, double voxel_m) const {
  const int offset = edge / 3;
  const Eigen::Vector3i cell =
      block * kBlockSide + Eigen::Vector3i(offset % 8, offset / 8 % 8, offset / 64);
  Vec3 p = cell.cast<double>() + Vec3::Constant(0.5);
  p[edge % 3] += fraction / 65535.0;
  SurfacePoint result;
  result.p_world = (p * voxel_m).cast<float>();
  result.normal_world =
      Eigen::Vector3f(normal_world[0], normal_world[1], normal_world[2]).normalized();
  result.colour = colour;
  result.label.object = object;
  result.label.probability = static_cast<float>(probability) / 255.0F;
  return result;
}

BlockMesh mesh_block(const SurfaceLayer& layer, BlockKey key, int min_views) {
  const Neighbourhood around(layer, key, min_views);
  if (around.block(0, 0, 0) == nullptr) return {};
  const CubeCorners corners(around);
  if (!corners.has_crossing()) return {};
  return BlockMesher(layer, around, corners).mesh();
}

}  // namespace ygslam
