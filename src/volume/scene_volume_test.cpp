// Rooms of which everything is known: where the surface must be, what is free, what is what.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numbers>

#include "volume/mesher.hpp"
#include "volume/reading.hpp"
#include "volume/volume_test_world.hpp"

namespace ygslam {
namespace {

using volume_test::look_at;
using volume_test::object_mesh;
using volume_test::render;
using volume_test::World;

constexpr SceneObjectId kBall{7};

VolumeConfig fine() {
  VolumeConfig config;
  config.surface.voxel_m = 0.03;
  config.space.cell_m = 0.06;
  return config;
}

World room_with_ball(SceneObjectId object = kBall) {
  World world;
  world.spheres.push_back({Vec3(0, 0, 0), 0.4, object});
  return world;
}

// Poses all around the middle of the room, which they look at.
std::vector<SE3> around(int count, double distance_m = 1.1) {
  std::vector<SE3> poses;
  for (int i = 0; i < count; ++i) {  // a spiral over the sphere of directions
    const double y = 1 - 2 * (i + 0.5) / count;
    const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(1 - y * y);
    const Vec3 direction(r * std::cos(angle), y, r * std::sin(angle));
    poses.push_back(look_at(distance_m * direction, Vec3::Zero(),
                            std::abs(y) > 0.9 ? Vec3(1, 0, 0) : Vec3(0, 1, 0)));
  }
  return poses;
}

Volume fuse(const World& world, const std::vector<SE3>& poses,
            std::optional<std::uint64_t> noise_seed = {}) {
  Volume volume(fine());
  std::uint64_t seed = noise_seed.value_or(0);
  for (const SE3& pose : poses)
    volume.integrate(render(world, pose, noise_seed ? std::optional(++seed) : std::nullopt), pose);
  return volume;
}

struct Accuracy {
  double mean_m = 0, share_off = 0, normals = 0;  // share of normals within 25 degrees
};
Accuracy accuracy(const World& world, const TriangleMesh& mesh, double off_m) {
  Accuracy a;
  for (const SurfacePoint& p : mesh.vertices) {
    const Vec3 p_world = p.p_world.cast<double>();
    const double distance_m = std::abs(world.distance_m(p_world));
    a.mean_m += distance_m;
    a.share_off += distance_m > off_m ? 1 : 0;
    Vec3 gradient;
    for (int axis = 0; axis < 3; ++axis)
      gradient[axis] = world.distance_m(p_world + 5e-3 * Vec3::Unit(axis)) -
                       world.distance_m(p_world - 5e-3 * Vec3::Unit(axis));
    a.normals += gradient.normalized().dot(p.normal_world.cast<double>()) > 0.9 ? 1 : 0;
  }
  const auto n = static_cast<double>(mesh.vertices.size());
  return {a.mean_m / n, a.share_off / n, a.normals / n};
}

TEST(SceneVolume, SurfacesLieWhereTheyAre) {
  const World world = room_with_ball();
  const Volume volume = fuse(world, around(40));
  const TriangleMesh mesh = volume_mesh(volume);
  ASSERT_GT(mesh.vertices.size(), 10000U);
  const Accuracy a = accuracy(world, mesh, 0.02);
  EXPECT_LT(a.mean_m, 0.003);
  EXPECT_LT(a.share_off, 0.01);
  EXPECT_GT(a.normals, 0.95);
}

TEST(SceneVolume, NoiseAveragesOut) {
  const World world = room_with_ball();
  const TriangleMesh mesh = volume_mesh(fuse(world, around(40), 1));
  ASSERT_GT(mesh.vertices.size(), 10000U);
  const Accuracy a = accuracy(world, mesh, 0.02);
  EXPECT_LT(a.mean_m, 0.004);
  EXPECT_LT(a.share_off, 0.01);
  EXPECT_GT(a.normals, 0.9);
}

TEST(SceneVolume, BallIsWatertightAndItsNormalsPointOut) {
  const World world = room_with_ball();
  const TriangleMesh mesh = volume_mesh(fuse(world, around(40)));
  const TriangleMesh ball = object_mesh(mesh, kBall);
  ASSERT_GT(ball.triangles.size(), 1000U);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  double volume_m3 = 0;
  for (const auto& t : ball.triangles) {
    for (std::size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
    const auto p = [&](std::size_t i) { return ball.vertices[t[i]].p_world.cast<double>().eval(); };
    volume_m3 += p(0).dot(p(1).cross(p(2))) / 6;
  }
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1);
    ASSERT_TRUE(edges.contains({edge.second, edge.first}));
  }
  // Euler: V - E + F = 2 for a ball without handles.
  EXPECT_EQ(ball.vertices.size() - edges.size() / 2 + ball.triangles.size(), 2U);
  const double true_m3 = 4.0 / 3 * std::numbers::pi * 0.4 * 0.4 * 0.4;
  EXPECT_NEAR(volume_m3, true_m3, 0.02 * true_m3);  // > 0: counter-clockwise from outside
  for (const SurfacePoint& p : ball.vertices) {
    EXPECT_GT(p.normal_world.dot(p.p_world.normalized()), 0.85F);
    EXPECT_EQ(p.label.object, kBall);
    EXPECT_EQ(p.colour, (Rgb8{200, 40, 40}));
  }
}

TEST(SceneVolume, FreeOccupiedAndUnknownAreThreeThings) {
  const World world = room_with_ball();
  const Volume volume = fuse(world, around(40), 3);
  const SpaceCells cells = space_cells(volume);
  const double cell_m = cells.cell_m;
  int free = 0, wrongly_free = 0, occupied = 0, wrongly_occupied = 0, inside = 0;
  std::map<SpaceState, int> counts;
  for (std::size_t i = 0; i < cells.cells.size(); ++i) {
    const SpaceCell& cell = cells.cells[i];
    ++counts[cell.state];
    if (i > 0) {
      const auto order = [](const SpaceCell& c) {
        return std::tuple(c.index.z(), c.index.y(), c.index.x());
      };
      ASSERT_LT(order(cells.cells[i - 1]), order(cell));
    }
    const Vec3 middle = (cell.index.cast<double>() + Vec3::Constant(0.5)) * cell_m;
    const double distance_m = world.distance_m(middle);
    if (distance_m < -1.5 * cell_m) ++inside;
    if (cell.state == SpaceState::kFree) {
      ++free;
      wrongly_free += distance_m < 0 ? 1 : 0;
      EXPECT_LT(cell.log_odds, 0);
    } else {
      ++occupied;
      wrongly_occupied += std::abs(distance_m) > 1.5 * cell_m ? 1 : 0;
      EXPECT_NE(cell.colour, Rgb8{});
    }
    EXPECT_GE(cell.log_odds, -2.0F);
    EXPECT_LE(cell.log_odds, 3.5F);
  }
  EXPECT_EQ(counts.count(SpaceState::kUnknown), 0U);
  EXPECT_EQ(wrongly_free, 0);
  EXPECT_EQ(wrongly_occupied, 0);
  EXPECT_EQ(inside, 0);  // nobody saw into the ball or behind the walls
  // Most of the room is known to be free.
  const double true_free = (3.0 * 2.4 * 3.0 - 0.27) / (cell_m * cell_m * cell_m);
  EXPECT_GT(free, 0.6 * true_free);
  EXPECT_GT(occupied, 3000);
}

TEST(SceneVolume, SurfaceOfASingleViewIsUnknown) {
  const World world = room_with_ball();
  const std::vector<SE3> poses = around(40);
  const auto occupied = [](const Volume& volume, const ReadingConfig& config) {
    const SpaceCells cells = space_cells(volume, config);
    return std::count_if(cells.cells.begin(), cells.cells.end(),
                         [](const SpaceCell& cell) { return cell.state == SpaceState::kOccupied; });
  };
  Volume volume = fuse(world, {poses.begin(), poses.begin() + 1});
  ReadingConfig trusting;
  trusting.min_views = 1;
  const auto seen_once = occupied(volume, trusting);
  EXPECT_GT(seen_once, 500);
  EXPECT_EQ(occupied(volume, {}), 0);
  volume.integrate(render(world, poses.front()), poses.front());
  EXPECT_EQ(occupied(volume, {}), seen_once);
}

TEST(SceneVolume, ThingThatWentAwayFreesItsSpace) {
  const World with = room_with_ball();
  World without = with;
  without.spheres.clear();
  const std::vector<SE3> poses = around(30);
  Volume volume = fuse(with, {poses.begin(), poses.begin() + 10});
  EXPECT_GT(object_mesh(volume_mesh(volume), kBall).triangles.size(), 500U);
  const Vec3 on_ball(0.39, 0.02, 0.02);
  EXPECT_EQ(volume.space().counts_at(on_ball).state(), SpaceState::kOccupied);
  EXPECT_EQ(volume.space().counts_at(Vec3::Zero()).state(), SpaceState::kUnknown);
  for (const SE3& pose : poses) volume.integrate(render(without, pose), pose);
  EXPECT_EQ(volume.space().counts_at(on_ball).state(), SpaceState::kFree);
  EXPECT_EQ(volume.space().counts_at(Vec3::Zero()).state(), SpaceState::kFree);
  // Also where nobody takes the old views back its surface goes.
  EXPECT_TRUE(object_mesh(volume_mesh(volume), kBall).triangles.empty());
  // And the walls stay.
  EXPECT_GT(volume_mesh(volume).vertices.size(), 10000U);
}

TEST(SceneVolume, MoversCarveUpToThemselvesAndLeaveNothing) {
  World world = room_with_ball(kNoSceneObject);
  world.spheres[0].excluded = true;
  const Volume volume = fuse(world, around(20));
  for (const SurfacePoint& p : volume_mesh(volume).vertices) EXPECT_GT(p.p_world.norm(), 0.8F);
  int free = 0;
  for (const SpaceCell& cell : space_cells(volume).cells) {
    const double r = (cell.index.cast<double>() + Vec3::Constant(0.5)).norm() * 0.06;
    EXPECT_GT(r, 0.4);  // neither a hit on it nor a view through it
    free += r < 0.6 && cell.state == SpaceState::kFree ? 1 : 0;
  }
  EXPECT_GT(free, 500);
}

TEST(SceneVolume, LabelsAreVotedForAndTakenBack) {
  const std::vector<SE3> poses = around(12);
  const World as_seven = room_with_ball(SceneObjectId{7}),
              as_nine = room_with_ball(SceneObjectId{9}), as_none = room_with_ball(kNoSceneObject);
  Volume volume(fine());
  const auto triangles = [&](SceneObjectId object) {
    return object_mesh(volume_mesh(volume), object).triangles.size();
  };
  for (const SE3& pose : poses) volume.integrate(render(as_seven, pose), pose);
  for (const SE3& pose : poses) volume.integrate(render(as_none, pose), pose);
  for (const SE3& pose : poses) volume.integrate(render(as_seven, pose), pose);
  const std::size_t ball = triangles(SceneObjectId{7});
  EXPECT_GT(ball, 500U);
  for (const SurfacePoint& p : object_mesh(volume_mesh(volume), SceneObjectId{7}).vertices) {
    if (p.label.object == SceneObjectId{7}) {
      EXPECT_NEAR(p.label.probability, 2.0F / 3, 0.01F);
    }
  }
  // Half of those who said 7 say 9 now: no majority against those who said nothing.
  for (const SE3& pose : poses) {
    volume.deintegrate(render(as_seven, pose), pose);
    volume.integrate(render(as_nine, pose), pose);
    volume.integrate(render(as_nine, pose), pose);
  }
  EXPECT_EQ(triangles(SceneObjectId{7}), 0U);
  EXPECT_EQ(triangles(SceneObjectId{9}), ball);
  for (const SE3& pose : poses) {
    volume.deintegrate(render(as_nine, pose), pose);
    volume.deintegrate(render(as_nine, pose), pose);
    volume.deintegrate(render(as_seven, pose), pose);
  }
  EXPECT_EQ(triangles(kNoSceneObject), volume_mesh(volume).triangles.size());
  for (const BlockKey key : volume.surface().blocks().keys())
    EXPECT_TRUE(volume.surface().blocks().find(key)->votes.empty());
}

TEST(SceneVolume, ViewsThatAreNotSureVoteForNothing) {
  const std::vector<SE3> poses = around(12);
  const World world = room_with_ball(SceneObjectId{7});
  const auto unsure = [&](const SE3& pose) {
    DepthView view = render(world, pose);
    for (std::uint8_t& object : view.object)
      if (object == 1) object = DepthView::kUnsure;
    return view;
  };
  Volume volume(fine());
  for (const SE3& pose : poses) volume.integrate(unsure(pose), pose);
  for (const SurfacePoint& p : volume_mesh(volume).vertices) {
    ASSERT_EQ(p.label.object, kNoSceneObject);
    if (p.p_world.norm() < 0.41F) {
      ASSERT_EQ(p.label.probability, 0) << "nobody knows what it is";
    }
  }
  // One that knows outvotes two that do not.
  for (const SE3& pose : poses) volume.integrate(unsure(pose), pose);
  for (const SE3& pose : poses) volume.integrate(render(world, pose), pose);
  const TriangleMesh ball = object_mesh(volume_mesh(volume), SceneObjectId{7});
  EXPECT_GT(ball.triangles.size(), 500U);
  for (const SurfacePoint& p : ball.vertices)
    if (p.label.object == SceneObjectId{7}) {
      ASSERT_EQ(p.label.probability, 1);
    }
  for (const SE3& pose : poses) {
    volume.deintegrate(unsure(pose), pose);
    volume.deintegrate(unsure(pose), pose);
    volume.deintegrate(render(world, pose), pose);
  }
  EXPECT_TRUE(volume.surface().blocks().keys().empty());
}

TEST(SceneVolume, SmallPiecesAreLeftOutThoseOfThingsWhenTheyAreSmaller) {
  for (const SceneObjectId object : {kNoSceneObject, SceneObjectId{7}}) {
    World world = room_with_ball(object);
    world.spheres[0].radius_m = 0.1;
    const Volume volume = fuse(world, around(30));
    const auto of_ball = [&](const ReadingConfig& config) {
      int triangles = 0;
      const TriangleMesh mesh = volume_mesh(volume, config);
      for (const auto& t : mesh.triangles)
        triangles += mesh.vertices[t[0]].p_world.norm() < 0.2F ? 1 : 0;
      return triangles;
    };
    ReadingConfig all;
    all.min_triangles = all.min_thing_triangles = 0;
    const int crumb = of_ball(all);
    ASSERT_GT(crumb, 20);
    ReadingConfig keep = all, drop = all;
    (object == kNoSceneObject ? keep.min_triangles : keep.min_thing_triangles) = crumb;
    (object == kNoSceneObject ? drop.min_triangles : drop.min_thing_triangles) = crumb + 1;
    EXPECT_EQ(of_ball(keep), crumb);
    EXPECT_EQ(of_ball(drop), 0);
  }
}

TEST(SceneVolume, MemoryIsAsEstimated) {
  const World world = room_with_ball();
  const Volume volume = fuse(world, around(60), 1);
  const Vec3 room_m = world.high - world.low;
  const double walls_m2 =
      2 * (room_m.x() * room_m.y() + room_m.y() * room_m.z() + room_m.z() * room_m.x());
  const double ball_m2 = 4 * std::numbers::pi * 0.4 * 0.4;
  const double estimate = estimated_bytes(volume.config(), walls_m2 + ball_m2, room_m.prod());
  EXPECT_GT(estimated_bytes(volume.config(), room_m), estimate);  // which is not furnished
  const auto bytes = static_cast<double>(volume.memory_bytes());
  EXPECT_GT(bytes, 0.5 * estimate);
  EXPECT_LT(bytes, 1.5 * estimate);
  VolumeConfig finer = volume.config();
  finer.surface.voxel_m /= 4;
  EXPECT_GT(estimated_bytes(finer, room_m), 8 * estimate);
}

TEST(SceneVolume, MisuseIsABug) {
  const World world = room_with_ball();
  const std::vector<SE3> poses = around(2);
  Volume volume(fine());
  EXPECT_THROW(volume.deintegrate(render(world, poses[0]), poses[0]), InternalError);
  volume.integrate(render(world, poses[0]), poses[0]);
  const SE3 nowhere(Mat3::Identity(), Vec3(std::nan(""), 0, 0));
  EXPECT_THROW(volume.integrate(render(world, poses[0]), nowhere), InternalError);
}

}  // namespace
}  // namespace ygslam
