#include "volume/depth_view.hpp"

#include <gtest/gtest.h>

#include "geometry/geometry_testing.hpp"
#include "volume/prepared_view.hpp"
#include "volume/volume_test_world.hpp"

namespace ygslam {
namespace {

using volume_test::look_at;
using volume_test::render;
using volume_test::World;

CameraConfig small_config() { return geometry_test::test_camera(140, 160, 120).config(); }

struct Recorded {
  DepthImage depth_m;
  ColourImage colour;
  Image<SceneObjectId> object;
  GreyImage excluded;
};

// What a distorted camera with a rolling shutter records of a world.
Recorded record(const World& world, const Camera& camera, const SE3& T_world_middle,
                const ReadOut& read_out) {
  const int width = camera.width();
  const int height = camera.height();
  Recorded r{DepthImage(width, height), ColourImage(width, height),
             Image<SceneObjectId>(width, height), GreyImage(width, height)};
  const RollingShutter shutter(height, read_out);
  for (int v = 0; v < height; ++v) {
    const SE3 T_world_depth =
        T_world_middle * SE3::exp(shutter.depth_time_s(v) * read_out.body_velocity);
    const SE3 T_world_colour =
        T_world_middle * SE3::exp(shutter.colour_time_s(v) * read_out.body_velocity);
    for (int u = 0; u < width; ++u) {
      const Vec3 ray = camera.unproject(camera.undistort({u, v}), 1);
      r.depth_m.at(u, v) =
          static_cast<float>(world.look(T_world_depth.t(), T_world_depth.R() * ray).distance_m);
      const auto seen = world.look(T_world_colour.t(), T_world_colour.R() * ray);
      r.colour.at(u, v) = seen.colour;
      r.object.at(u, v) = seen.object;
      r.excluded.at(u, v) = seen.excluded ? 1 : 0;
    }
  }
  return r;
}

World two_things() {
  World world;
  world.spheres.push_back({Vec3(-0.3, 0.1, 0.7), 0.35, SceneObjectId{41}, {250, 0, 0}});
  world.cuboids.push_back(
      {Vec3(0.4, -0.4, 0.6), Vec3(0.8, 0.5, 0.9), kNoSceneObject, {0, 0, 250}, true});
  return world;
}

struct Agreement {
  int pixels = 0, depth = 0, colour = 0, object = 0;
};
// How many pixels say the same as an ideal camera's.
Agreement compare(const DepthView& view, const DepthView& ideal) {
  Agreement a;
  for (std::size_t i = 0; i < view.depth.size(); ++i) {
    const int depth = view.depth.data()[i];
    if (depth == 0) continue;
    ++a.pixels;
    a.depth += std::abs(depth - ideal.depth.data()[i]) <= 0.01 / DepthView::kUnit_m ? 1 : 0;
    a.colour += view.colour.data()[i] == ideal.colour.data()[i] ? 1 : 0;
    a.object += view.object.data()[i] == ideal.object.data()[i] ? 1 : 0;
  }
  return a;
}

TEST(DepthView, OfAnIdealCameraIsWhatWasRecorded) {
  const World world = two_things();
  const Camera camera(small_config());
  const SE3 pose = look_at(Vec3(0, 0, -1), Vec3(0, 0, 1));
  const Recorded r = record(world, camera, pose, {});
  const DepthView view = make_depth_view({r.depth_m, r.colour, r.object, r.excluded}, camera);
  const DepthView ideal = render(world, pose);
  const Agreement a = compare(view, ideal);
  EXPECT_EQ(a.pixels, 160 * 120);
  EXPECT_EQ(a.colour, a.pixels);
  EXPECT_EQ(a.object, a.pixels);
  EXPECT_EQ(a.depth, a.pixels);
  ASSERT_EQ(view.objects, std::vector<SceneObjectId>{SceneObjectId{41}});
}

TEST(DepthView, UndoesDistortionAndRollingShutter) {
  const World world = two_things();
  CameraConfig config = small_config();
  config.k1 = 0.15;
  config.k2 = -0.2;
  config.p1 = 0.002;
  const Camera camera(config);
  const SE3 pose = look_at(Vec3(0, 0, -1), Vec3(0, 0, 1));
  const DepthView ideal = render(world, pose);
  ReadOut read_out;
  read_out.body_velocity << 0.3, -0.2, 0.1, 0.5, 1.0, -0.4;
  for (const double delay_s : {0.0, 0.012}) {  // depth at colour's time, and at its own
    read_out.times = {0.03, 0.03, delay_s};
    const Recorded r = record(world, camera, pose, read_out);
    const DepthView view =
        make_depth_view({r.depth_m, r.colour, r.object, r.excluded}, camera, read_out);
    const Agreement a = compare(view, ideal);
    EXPECT_GT(a.pixels, 0.85 * 160 * 120);
    EXPECT_GT(a.depth, 0.95 * a.pixels);
    EXPECT_GT(a.colour, 0.95 * a.pixels);
    EXPECT_GT(a.object, 0.95 * a.pixels);
    // Taken as they were recorded the images say something else.
    const Agreement raw = compare(
        make_depth_view({r.depth_m, r.colour, r.object, r.excluded}, Camera(small_config())),
        ideal);
    EXPECT_LT(raw.depth, 0.9 * raw.pixels);
  }
}

TEST(DepthView, MissingDepthAndObjectsBeyondItsNumbers) {
  const Camera camera(small_config());
  DepthImage depth_m(160, 120, 0.0F);
  depth_m.at(3, 4) = 20.0F;  // beyond the unit's range
  const ColourImage colour(160, 120);
  const GreyImage nothing;
  const Image<SceneObjectId> no_objects;
  const DepthView view = make_depth_view({depth_m, colour, no_objects, nothing}, camera);
  EXPECT_EQ(view.depth.at(0, 0), 0);
  EXPECT_EQ(view.depth.at(3, 4), 65534);
  Image<SceneObjectId> many(160, 120);
  std::fill(depth_m.begin(), depth_m.end(), 1.0F);
  for (std::size_t i = 0; i < 253; ++i) many.data()[i] = static_cast<SceneObjectId>(i + 1);
  EXPECT_EQ(make_depth_view({depth_m, colour, many, nothing}, camera).objects.size(), 253U);
  many.data()[253] = SceneObjectId{254};
  EXPECT_THROW(static_cast<void>(make_depth_view({depth_m, colour, many, nothing}, camera)),
               InternalError);
}

TEST(PreparedView, KnowsSlopeWeightAndJumps) {
  World world;
  world.cuboids.push_back({Vec3(-0.4, -1.2, 0.2), Vec3(0.1, 1.2, 0.3)});
  const SE3 pose = look_at(Vec3(0.3, 0, -1), Vec3(-0.3, 0.2, 1));
  DepthView view = render(world, pose);
  view.object.at(80, 60) = DepthView::kExcluded;
  PreparedView prepared;
  prepared.assign(view, {});
  int edges = 0, surfaces = 0, flat = 0;
  for (int v = 2; v < 118; ++v) {
    for (int u = 2; u < 158; ++u) {
      const std::uint32_t geometry = prepared.geometry()[v * 160 + u];
      const auto depth = [&](int du, int dv) {
        return view.depth.at(u + du, v + dv) * DepthView::kUnit_m;
      };
      EXPECT_EQ(geometry & 0xffffU, view.depth.at(u, v));
      const auto weight = geometry >> 24;
      double jump_m = 0;
      for (const auto& [du, dv] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}})
        jump_m = std::max(jump_m, std::abs(depth(du, dv) - depth(0, 0)));
      if (jump_m > 0.1) {
        ++edges;
        EXPECT_EQ(weight, 0U);
      } else if (jump_m < 0.02 && (u != 80 || v != 60)) {
        ++surfaces;
        EXPECT_GE(weight, 1U);
        EXPECT_LE(weight, 15U);
        // The true slope, from the walls' normals.
        const Vec3 ray((u - 79.5) / 140, (v - 59.5) / 140, 1);
        const Vec3 p_world = pose * (ray * depth(0, 0));
        Vec3 gradient;
        for (int axis = 0; axis < 3; ++axis)
          gradient[axis] = world.distance_m(p_world + 1e-3 * Vec3::Unit(axis)) -
                           world.distance_m(p_world - 1e-3 * Vec3::Unit(axis));
        const double slope = std::abs(gradient.normalized().dot(pose.R() * ray));
        const double found = ((geometry >> 16) & 0xffU) / 192.0;
        flat += std::abs(slope - found) < 0.03 ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(prepared.geometry()[60 * 160 + 80] >> 24, 0U);
  EXPECT_GT(edges, 200);
  EXPECT_GT(surfaces, 14000);
  EXPECT_GT(flat, 0.93 * surfaces);  // the rest lies within a tile of a corner
}

TEST(PreparedView, FarAndGrazingSurfacesWeighLess) {
  PreparedView prepared;
  std::uint32_t last = 16;
  for (const double depth_m : {0.6, 1.3, 2.0, 3.0, 4.6}) {
    World world;
    world.low = Vec3::Constant(-50);
    world.high = Vec3(50, 50, depth_m);
    prepared.assign(render(world, SE3()), {});
    const std::uint32_t weight = prepared.geometry()[60 * 160 + 80] >> 24;
    EXPECT_LT(weight, last);
    last = weight;
  }
  EXPECT_EQ(last, 0U);  // beyond the range of surfaces
}

}  // namespace
}  // namespace ygslam
