#include "simulation/random/random_frames.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "simulation/people/baked_bodies.hpp"
#include "simulation/random/random_body.hpp"
#include "simulation/random/random_scene.hpp"

namespace ygslam::sim {
namespace {

RandomFrames small_frames(std::uint64_t seed, int threads = 2) {
  RandomFramesOptions options;
  options.seed = seed;
  options.width = 96;
  options.height = 72;
  options.shots = 6;
  options.texture_size = 32;
  options.threads = threads;
  Result<RandomFrames> frames = RandomFrames::open(options);
  EXPECT_TRUE(frames.ok());
  return std::move(*frames);
}

template <typename T>
bool same_pixels(const Image<T>& a, const Image<T>& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin());
}

TEST(RandomFrames, SameSeedSameBytesWhateverTheThreads) {
  RandomFrames one = small_frames(4, 1);
  RandomFrames two = small_frames(4, 2);
  RandomFrames other = small_frames(5);
  bool differs = false;
  for (int i = 0; i < 14; ++i) {
    const RandomFrame a = one.next();
    const RandomFrame b = two.next();
    EXPECT_EQ(a.world, b.world);
    EXPECT_EQ(a.camera.fx, b.camera.fx);
    EXPECT_TRUE(same_pixels(a.colour, b.colour));
    EXPECT_TRUE(same_pixels(a.depth_m, b.depth_m));
    EXPECT_TRUE(same_pixels(a.people, b.people));
    differs |= !same_pixels(a.depth_m, other.next().depth_m);
  }
  EXPECT_TRUE(differs);
}

TEST(RandomFrames, ShowManyRoomsWithAndWithoutPeople) {
  RandomFrames frames = small_frames(11);
  constexpr int kFrames = 72;
  std::set<int> worlds;
  std::set<double> focal_lengths;
  std::size_t area = 0;
  std::size_t holes = 0;
  int empty = 0;
  int blind = 0;  // less than an eighth of the depth
  int crowded = 0;
  std::size_t pixels = 0;
  for (int i = 0; i < kFrames; ++i) {
    const RandomFrame frame = frames.next();
    worlds.insert(frame.world);
    focal_lengths.insert(frame.camera.fx);
    pixels += frame.people.size();
    std::size_t here = 0;
    int most = 0;
    for (const std::uint8_t id : frame.people) {
      ASSERT_LT(id, kFirstThing);  // chairs are nobody
      here += id > 0 ? 1 : 0;
      most = std::max(most, static_cast<int>(id));
    }
    area += here;
    empty += here == 0 ? 1 : 0;
    crowded += most > 2 ? 1 : 0;
    std::size_t holes_here = 0;
    for (const float z : frame.depth_m) {
      ASSERT_GE(z, 0);
      holes_here += z == 0 ? 1 : 0;
    }
    holes += holes_here;
    blind += 8 * holes_here > 7 * frame.depth_m.size() ? 1 : 0;
  }
  EXPECT_GE(worlds.size(), 12U);
  EXPECT_EQ(focal_lengths.size(), worlds.size());
  EXPECT_GT(empty, kFrames / 10);
  EXPECT_LT(empty, kFrames / 2);
  EXPECT_GT(crowded, 3);
  EXPECT_GT(area, pixels / 20);
  EXPECT_LT(area, pixels / 2);
  EXPECT_GT(holes, pixels / 100);
  EXPECT_GT(blind, 0) << "depth fails in some";
  EXPECT_LT(holes, pixels / 2);
}

TEST(RandomFigure, BodiesDifferInHeightAndStandOnTheFloor) {
  const Result<BodyModel> baked = baked_bodies();
  ASSERT_TRUE(baked.ok());
  Rng rng(3);
  MaterialLibrary materials(16);
  double shortest = 10;
  double tallest = 0;
  for (int i = 0; i < 40; ++i) {
    const RandomFigure figure = random_figure(*baked, materials, rng);
    const BodyModel& model = figure.model;
    ASSERT_EQ(model.shapes[0].points.size(), model.weights.size());
    ASSERT_EQ(model.shapes[0].points.size(), figure.topology.uv.size());
    for (const Triangle& triangle : figure.topology.triangles) {
      for (const std::uint32_t corner : triangle.corner) ASSERT_LT(corner, model.weights.size());
    }
    for (const BodyModel::Weights& w : model.weights)
      ASSERT_EQ(w.share[0] + w.share[1] + w.share[2] + w.share[3], 255);
    float lowest = 10;
    for (const Vec3f& p : model.shapes[0].points) lowest = std::min(lowest, p.z());
    EXPECT_NEAR(lowest, 0, 0.06);
    shortest = std::min(shortest, figure.height_m);
    tallest = std::max(tallest, figure.height_m);
  }
  EXPECT_LT(shortest, 1.45);  // children
  EXPECT_GT(shortest, 0.7);
  EXPECT_GT(tallest, 1.8);
  EXPECT_LT(tallest, 2.4);
}

}  // namespace
}  // namespace ygslam::sim
