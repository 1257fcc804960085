#include <gtest/gtest.h>

#include <bit>

#include "geometry/random_vector.hpp"
#include "volume/space_kernel.hpp"
#include "volume/surface_kernel.hpp"
#include "volume/volume_test_world.hpp"

namespace ygslam {
namespace {

using volume_test::look_at;
using volume_test::render;
using volume_test::World;

struct Posed {
  PreparedView view;
  SE3 T_world_camera;
};

// A view with holes, an object, a mover and noise, somewhere far from the world's origin.
Posed random_view(std::uint64_t seed) {
  Rng rng(seed);
  World world;
  world.spheres.push_back({Vec3(0.2, 0.3, 0.1), 0.35, SceneObjectId{7}});
  world.cuboids.push_back(
      {Vec3(-1.2, 0.4, -1.1), Vec3(-0.5, 1.2, -0.4), SceneObjectId{3}, {}, true});
  const auto inside = [&] { return random_in_box<3>(rng, {-1.3, -1, -1.3}, {1.3, 0, 1.3}); };
  const Vec3 target = inside();
  const SE3 pose = look_at(inside(), target);
  DepthView view = render(world, pose, seed);
  for (int i = 0; i < 500; ++i)
    view.depth.data()[rng.below(static_cast<std::uint32_t>(view.depth.size()))] = 0;
  Posed posed;
  posed.view.assign(view, {});
  posed.T_world_camera = pose;
  return posed;
}

// Blocks all around the camera, also beside and behind it.
template <typename Visit>
void visit_blocks(const SE3& T_world_camera, double block_m, int reach, const Visit& visit) {
  const Eigen::Vector3i middle = (T_world_camera.t() / block_m).array().floor().cast<int>();
  for (int z = -reach; z <= reach; ++z)
    for (int y = -reach; y <= reach; ++y)
      for (int x = -reach; x <= reach; ++x) visit(block_key(middle + Eigen::Vector3i(x, y, z)));
}

TEST(SurfaceKernel, VectorsAndScalarsGiveEqualBits) {
  int blocks = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Posed posed = random_view(seed);
    const SurfaceConfig config{0.03, 3, 3};
    const SurfaceProjection projection(posed.view, posed.T_world_camera, config, {}, 1e-4);
    BrickPool pool;
    visit_blocks(posed.T_world_camera, kBlockSide * config.voxel_m, 10, [&](BlockKey key) {
      SurfaceBlock fast, plain;
      const bool any = fuse_block(projection, key, 1, pool, fast);
      ASSERT_EQ(any, fuse_block_plain(projection, key, 1, pool, plain));
      ASSERT_EQ(fast.contributions, plain.contributions);
      ASSERT_EQ(fast.votes.size(), plain.votes.size());
      for (std::size_t i = 0; i < fast.votes.size(); ++i) {
        ASSERT_EQ(fast.votes[i].object, plain.votes[i].object);
        ASSERT_EQ(fast.votes[i].votes, plain.votes[i].votes);
      }
      for (std::size_t i = 0; i < fast.bricks.size(); ++i) {
        ASSERT_EQ(fast.bricks[i] == nullptr, plain.bricks[i] == nullptr);
        if (fast.bricks[i] != nullptr) {
          ASSERT_TRUE(*fast.bricks[i] == *plain.bricks[i]);
        }
      }
      blocks += any ? 1 : 0;
      // Each takes back what the other added.
      fuse_block(projection, key, -1, pool, plain);
      fuse_block_plain(projection, key, -1, pool, fast);
      ASSERT_TRUE(fast.empty() && plain.empty() && fast.votes.empty() && plain.votes.empty());
    });
  }
  EXPECT_GT(blocks, 400);
}

TEST(SpaceKernel, VectorsAndScalarsGiveEqualBits) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Posed posed = random_view(seed);
    const SpaceConfig config;
    const SpaceProjection projection(posed.view, posed.T_world_camera, config, {});
    int free = 0;
    visit_blocks(posed.T_world_camera, kBlockSide * config.cell_m, 6, [&](BlockKey key) {
      const CellMask fast = cells_seen_through(projection, key);
      ASSERT_EQ(fast.rows, cells_seen_through_plain(projection, key).rows);
      for (const std::uint8_t row : fast.rows) free += std::popcount(row);
    });
    EXPECT_GT(free, 1000);
  }
}

// Blocks that are left out because they seem hidden would not have counted anything.
TEST(SpaceScan, LooksIntoEveryBlockThatIsSeenThrough) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Posed posed = random_view(seed);
    const SpaceConfig config;
    const SeenSpace seen = SpaceScan(config, {}).step(posed.view, posed.T_world_camera, 1);
    const SpaceProjection projection(posed.view, posed.T_world_camera, config, {});
    visit_blocks(posed.T_world_camera, kBlockSide * config.cell_m, 12, [&](BlockKey key) {
      const CellMask through = cells_seen_through(projection, key);
      for (int i = 0; i < kBlockCells; ++i) {
        const Eigen::Vector3i at(i % 8, i / 8 % 8, i / 64);
        const CellObservation observed = seen.at(block_of(key) * kBlockSide + at);
        ASSERT_EQ(observed == CellObservation::kThrough,
                  through.at(at.x(), at.y(), at.z()) && observed != CellObservation::kHit);
      }
    });
  }
}

TEST(DepthPyramid, HoldsTheMinimumOfEverySquare) {
  constexpr int kColumns = 21, kRows = 13;
  Rng rng(5);
  std::vector<std::uint16_t> tiles(kColumns * kRows);
  for (auto& tile : tiles) tile = static_cast<std::uint16_t>(rng.below(60000));
  DepthPyramid pyramid;
  pyramid.assign(kColumns, kRows, tiles);
  for (int level = 0; level < DepthPyramid::kLevels; ++level) {
    for (int y = 0; y < kRows; ++y) {
      for (int x = 0; x < kColumns; ++x) {
        std::uint16_t least = DepthPyramid::kNone;
        for (int v = y; v < std::min(y + (1 << level), kRows); ++v)
          for (int u = x; u < std::min(x + (1 << level), kColumns); ++u)
            least = std::min(least, tiles[static_cast<std::size_t>(v * kColumns + u)]);
        ASSERT_EQ(pyramid.planes()[level * pyramid.plane_size() + y * kColumns + x], least);
      }
    }
  }
}

}  // namespace
}  // namespace ygslam
