#include "volume/volume.hpp"

#include <gtest/gtest.h>

#include <map>
#include <numbers>

#include "geometry/random_vector.hpp"
#include "volume/mesher.hpp"
#include "volume/reading.hpp"
#include "volume/volume_test_world.hpp"

namespace ygslam {
namespace {

using volume_test::look_at;
using volume_test::render;
using volume_test::World;

VolumeConfig coarse(int threads = 1) {
  VolumeConfig config;
  config.surface.voxel_m = 0.04;
  config.space.cell_m = 0.08;
  config.threads = threads;
  return config;
}

World furnished() {
  World world;
  world.spheres.push_back({Vec3(0.2, 0.3, 0.1), 0.35, SceneObjectId{7}});
  world.cuboids.push_back({Vec3(-1.2, 0.4, -1.1), Vec3(-0.5, 1.2, -0.4), SceneObjectId{3}});
  world.cuboids.push_back(
      {Vec3(0.7, -0.2, 0.4), Vec3(1.1, 1.2, 0.8), kNoSceneObject, {10, 10, 10}, true});
  return world;
}

SE3 random_pose(Rng& rng) {
  const auto inside = [&] { return random_in_box<3>(rng, {-1.3, -1, -1.3}, {1.3, 0, 1.3}); };
  const Vec3 target = inside();
  return look_at(inside(), target);
}

// What is in a volume, bit by bit, whatever way it came about.
void expect_same(const Volume& a, const Volume& b) {
  EXPECT_EQ(a.views(), b.views());
  const auto keys = a.surface().blocks().keys();
  ASSERT_EQ(keys, b.surface().blocks().keys());
  for (const BlockKey key : keys) {
    const SurfaceBlock& p = *a.surface().blocks().find(key);
    const SurfaceBlock& q = *b.surface().blocks().find(key);
    ASSERT_EQ(p.contributions, q.contributions);
    for (std::size_t i = 0; i < p.bricks.size(); ++i) {
      ASSERT_EQ(p.bricks[i] == nullptr, q.bricks[i] == nullptr);
      if (p.bricks[i] != nullptr) {
        ASSERT_TRUE(*p.bricks[i] == *q.bricks[i]);
      }
    }
    ASSERT_EQ(p.votes.size(), q.votes.size());
    for (std::size_t i = 0; i < p.votes.size(); ++i) {
      ASSERT_EQ(p.votes[i].object, q.votes[i].object);
      ASSERT_EQ(p.votes[i].votes, q.votes[i].votes);
    }
  }
  const auto space_keys = a.space().blocks().keys();
  ASSERT_EQ(space_keys, b.space().blocks().keys());
  for (const BlockKey key : space_keys) {
    const SpaceBlock& p = *a.space().blocks().find(key);
    const SpaceBlock& q = *b.space().blocks().find(key);
    ASSERT_EQ(p.hits, q.hits);
    ASSERT_EQ(p.through, q.through);
  }
  EXPECT_EQ(a.fingerprint(), b.fingerprint());
}

void expect_same_mesh(const TriangleMesh& a, const TriangleMesh& b) {
  ASSERT_EQ(a.triangles, b.triangles);
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  for (std::size_t i = 0; i < a.vertices.size(); ++i) {
    ASSERT_EQ(a.vertices[i].p_world, b.vertices[i].p_world);
    ASSERT_EQ(a.vertices[i].normal_world, b.vertices[i].normal_world);
    ASSERT_EQ(a.vertices[i].colour, b.vertices[i].colour);
    ASSERT_EQ(a.vertices[i].label.object, b.vertices[i].label.object);
  }
}

/// Other pixels count, show another object, or none; objects have other numbers.
DepthView with_other_pixels(DepthView view, Rng& rng) {
  const auto within = [&](int side) {
    return static_cast<int>(rng.next() % static_cast<std::uint64_t>(side));
  };
  for (int patch = 0; patch < 3; ++patch) {
    const int u0 = within(view.object.width()), v0 = within(view.object.height());
    const int u1 = std::min(u0 + 1 + within(40), view.object.width());
    const int v1 = std::min(v0 + 1 + within(40), view.object.height());
    const std::uint8_t object = patch == 0   ? DepthView::kExcluded
                                : patch == 1 ? DepthView::kNothing
                                             : DepthView::kUnsure;
    for (int v = v0; v < v1; ++v)
      std::fill(view.object.row(v) + u0, view.object.row(v) + u1, object);
  }
  for (SceneObjectId& object : view.objects)
    if (rng.uniform() < 0.3) object = SceneObjectId{static_cast<std::uint16_t>(20 + within(5))};
  view.spared.clear();
  for (int i = 0; i < 50; ++i) {
    const int z = within(40) - 20, y = within(30) - 15;
    view.spared.emplace_back(within(40) - 20, y, z);
  }
  return view;
}

TEST(Volume, ExchangedPixelsEqualViewsFusedFromNothing) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Rng rng(seed);
    const World world = furnished();
    Volume live(coarse(1 + static_cast<int>(seed % 2)));
    std::vector<DepthView> views;
    std::vector<SE3> poses;
    std::vector<SeenSpace> seen;
    for (std::uint64_t i = 0; i < 3; ++i) {
      const SE3 pose = random_pose(rng);
      poses.push_back(pose);
      views.push_back(render(world, pose, seed * 100 + i));  // grazing walls among them
      seen.push_back(live.integrate(views.back(), pose));
    }
    for (int step = 0; step < 8; ++step) {
      const std::size_t i = rng.next() % views.size();
      DepthView now = with_other_pixels(views[i], rng);
      seen[i] = live.exchange(views[i], seen[i], now, poses[i]);
      views[i] = std::move(now);
    }
    Volume fresh(coarse());
    for (std::size_t i = 0; i < views.size(); ++i) fresh.integrate(views[i], poses[i]);
    expect_same(live, fresh);
    for (std::size_t i = 0; i < views.size(); ++i) live.deintegrate(views[i], poses[i]);
    EXPECT_TRUE(live.surface().blocks().keys().empty());
    EXPECT_TRUE(live.space().blocks().keys().empty());
  }
}

TEST(Volume, LiveEqualsFusedFromNothing) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Rng rng(seed);
    World world = furnished();
    std::vector<DepthView> views;
    for (int i = 0; i < 8; ++i) {
      if (i == 4) world.spheres[0].middle += Vec3(-0.4, 0, 0.3);  // somebody moved it
      views.push_back(render(world, random_pose(rng), seed * 100 + static_cast<std::uint64_t>(i)));
    }
    Volume live(coarse(1 + static_cast<int>(seed % 3)));
    Mesher mesher;
    std::map<std::size_t, SE3> in;  // by view
    for (int step = 0; step < 40; ++step) {
      const std::size_t i = rng.next() % views.size();
      const SE3 pose = random_pose(rng);
      const auto found = in.find(i);
      if (found == in.end()) {
        live.integrate(views[i], pose);
        in[i] = pose;
      } else if (rng.uniform() < 0.4) {
        live.deintegrate(views[i], found->second);
        in.erase(found);
      } else {
        live.move(views[i], found->second, pose);
        found->second = pose;
      }
      if (rng.uniform() < 0.3) mesher.update(live);
    }
    mesher.update(live);
    for (const int threads : {1, 2, 4}) {
      Volume fresh(coarse(threads));
      std::vector<std::size_t> order;
      for (const auto& [i, pose] : in) order.push_back(i);
      for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[rng.next() % i]);
      for (const std::size_t i : order) fresh.integrate(views[i], in[i]);
      expect_same(live, fresh);
      expect_same_mesh(mesher.mesh(live), volume_mesh(fresh));
    }
    const auto taken = static_cast<double>(live.memory_bytes());
    live.clear();
    expect_same(live, Volume(coarse()));
    for (const auto& [i, pose] : in) live.integrate(views[i], pose);
    EXPECT_LT(static_cast<double>(live.memory_bytes()), 1.05 * taken) << "is used again";
    mesher.update(live);
    expect_same_mesh(mesher.mesh(live), volume_mesh(live));
    for (const auto& [i, pose] : in) live.deintegrate(views[i], pose);
    EXPECT_EQ(live.surface().blocks().size(), 0U);
    EXPECT_EQ(live.space().blocks().size(), 0U);
    EXPECT_EQ(live.fingerprint(), Volume(coarse()).fingerprint());
    mesher.update(live);
    EXPECT_TRUE(mesher.mesh(live).vertices.empty());
  }
}

TEST(Volume, AViewIsTakenBackWithWhatItSaidOfSpace) {
  Rng rng(5);
  const World world = furnished();
  const SE3 first = random_pose(rng), second = random_pose(rng);
  const DepthView view = render(world, first, 1), other = render(world, second, 1);
  Volume live(coarse()), alone(coarse());
  const SeenSpace seen = live.integrate(view, first);
  live.integrate(other, second);
  live.deintegrate(view, first, seen);
  alone.integrate(other, second);
  expect_same(live, alone);
  EXPECT_EQ(live.views(), 1);
}

TEST(Volume, CellsThatAViewMustNotCarveAreExchanged) {
  Rng rng(3);
  const World world = furnished();
  const SE3 T_world_camera = random_pose(rng);
  DepthView view = render(world, T_world_camera, 1), other = view;
  Volume live(coarse()), fresh(coarse()), bare(coarse());
  const SeenSpace seen = bare.integrate(view, T_world_camera);
  for (const BlockKey key : bare.space().blocks().keys()) {
    const Eigen::Vector3i first = block_of(key) * kBlockSide;
    view.spared.push_back(first + Eigen::Vector3i(1, 2, 3));
    other.spared.push_back(first + Eigen::Vector3i(6, 5, 4));
  }
  live.integrate(view, T_world_camera);
  ASSERT_NE(live.fingerprint(), bare.fingerprint());
  live.exchange_spared(seen, view.spared, other.spared);
  fresh.integrate(other, T_world_camera);
  expect_same(live, fresh);
  live.exchange_spared(seen, other.spared, {});
  expect_same(live, bare);
}

TEST(SeenSpace, IsWhatItsViewCounts) {
  Rng rng(4);
  const World world = furnished();
  for (int trial = 0; trial < 4; ++trial) {
    const SE3 T_world_camera = random_pose(rng);
    const DepthView view = render(world, T_world_camera, 1);
    Volume volume(coarse());
    const SeenSpace looked = volume.observe(view, T_world_camera);
    EXPECT_EQ(volume.views(), 0);
    EXPECT_EQ(volume.space().blocks().size(), 0U);
    const SeenSpace seen = volume.integrate(view, T_world_camera);
    ASSERT_EQ(seen.size(), volume.space().blocks().size());
    int through = 0;
    for (const BlockKey key : volume.space().blocks().keys()) {
      for (int i = 0; i < kBlockCells; ++i) {
        const Eigen::Vector3i cell =
            block_of(key) * kBlockSide + Eigen::Vector3i(i % 8, i / 8 % 8, i / 64);
        const SpaceCounts counts = volume.space().counts(cell);
        ASSERT_EQ(counts.hits, seen.at(cell) == CellObservation::kHit ? 1 : 0);
        ASSERT_EQ(counts.through, seen.at(cell) == CellObservation::kThrough ? 1 : 0);
        ASSERT_EQ(looked.at(cell), seen.at(cell));
        through += counts.through;
      }
    }
    EXPECT_GT(through, 100);
    EXPECT_EQ(seen.at({100000, 0, 0}), CellObservation::kNothing);
  }
}

}  // namespace
}  // namespace ygslam
