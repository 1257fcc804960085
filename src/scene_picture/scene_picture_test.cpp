#include "scene_picture/scene_picture.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "scene/class_colour.hpp"
#include "scene/testing/sample_scene.hpp"
#include "scene_picture/annotate.hpp"
#include "scene_picture/raster.hpp"

namespace ygslam {
namespace {

using testing::sample_scene;
using testing::SampleScene;

const Vec3 kUps[] = {Vec3(0, 0, 1), Vec3(0, -1, 0), Vec3(1, 0, 0), Vec3(0.2, -1, 0.3)};

Vec2 pixel_of(const Viewpoint& view, const Vec3& p_world) {
  const Vec3 p = view.T_camera_world * p_world;
  EXPECT_GT(p.z(), 0);
  return view.focal_px / p.z() * p.head<2>() +
         Vec2((view.width - 1) / 2.0, (view.height - 1) / 2.0);
}

Rgb8 shade_at(const ColourImage& image, const Vec2& pixel) {
  return image.at(static_cast<int>(std::lround(pixel.x())),
                  static_cast<int>(std::lround(pixel.y())));
}

// Equal up to the shade, which darkens all channels alike.
bool same_hue(Rgb8 a, Rgb8 b) {
  const Eigen::Vector3f u = Eigen::Vector3f(a.r, a.g, a.b), v = Eigen::Vector3f(b.r, b.g, b.b);
  return u.normalized().dot(v.normalized()) > 0.999F;
}

TEST(Viewpoint, LooksAtItsTargetWithUpAtTheTop) {
  Viewpoint view;
  view.T_camera_world = look_at(Vec3(3, 1, 2), Vec3(0, 0.5, 1), Vec3(0, 0, 1));
  EXPECT_NEAR((pixel_of(view, Vec3(0, 0.5, 1)) - Vec2(639.5, 479.5)).norm(), 0, 1e-9);
  EXPECT_LT(pixel_of(view, Vec3(0, 0.5, 1.2)).y(), 479);
  EXPECT_NEAR(view.T_camera_world.R().determinant(), 1, 1e-12);
  EXPECT_TRUE(look_at(Vec3(0, 0, 5), Vec3::Zero(), Vec3(0, 0, 1)).is_finite()) << "straight down";
}

TEST(Viewpoint, AnOverviewHoldsTheWholeSceneAndFillsThePicture) {
  for (const Vec3& up : kUps) {
    const SampleScene scene = sample_scene(up);
    for (const double elevation : {0.3, 0.9, 1.6}) {
      Overview options;
      options.elevation_rad = elevation;
      const Viewpoint view = overview(scene.mesh.vertices, scene.gravity, options);
      Vec2 low(1e9, 1e9), high(-1e9, -1e9);
      for (const SurfacePoint& vertex : scene.mesh.vertices) {
        const Vec2 pixel = pixel_of(view, vertex.p_world.cast<double>());
        low = low.cwiseMin(pixel);
        high = high.cwiseMax(pixel);
      }
      EXPECT_GE(low.minCoeff(), 0);
      EXPECT_LT(high.x(), view.width);
      EXPECT_LT(high.y(), view.height);
      EXPECT_GT(std::max((high.x() - low.x()) / view.width, (high.y() - low.y()) / view.height),
                0.85);
      // Up in the world is up in the picture, as far as it can be seen.
      const Vec3 middle = scene.T_world_room * Vec3(1, 0.7, 0);
      const Vec3 above = middle + 0.1 * up.normalized();
      if (elevation > 1.5) continue;
      EXPECT_LT(pixel_of(view, above).y(), pixel_of(view, middle).y());
    }
  }
  EXPECT_TRUE(overview({}, {}).T_camera_world.is_finite());
}

TEST(Viewpoint, AFewStrayPointsDoNotMakeTheSceneSmall) {
  SampleScene scene = sample_scene(Vec3(0, 0, 1));
  const Viewpoint before = overview(scene.cloud, scene.gravity);
  scene.cloud.front().p_world = Eigen::Vector3f(100, 50, 0);
  const Viewpoint after = overview(scene.cloud, scene.gravity);
  EXPECT_LT((before.T_camera_world.inverse().t() - after.T_camera_world.inverse().t()).norm(), 0.8);
}

const Viewpoint kAhead{64, 48, 50, {}};

std::array<RasterVertex, 3> triangle_of(const Eigen::Vector3f& a, const Eigen::Vector3f& b,
                                        const Eigen::Vector3f& c, float grey) {
  const Eigen::Array3f colour = Eigen::Array3f::Constant(grey);
  return {{{a, colour}, {b, colour}, {c, colour}}};
}

TEST(Raster, AreaAndPlaceAreThoseOfTheProjection) {
  Raster raster(kAhead, {});
  // At 2 m, 0.4 m are 10 px: a square from the middle to the right and down, in two triangles.
  const Eigen::Vector3f a(0, 0, 2), b(0.4F, 0, 2), c(0.4F, 0.4F, 2), d(0, 0.4F, 2);
  raster.add_triangle(triangle_of(a, b, c, 200), 1);
  raster.add_triangle(triangle_of(a, c, d, 200), 2);
  const ColourImage image = raster.image();
  for (int v = 0; v < 48; ++v)
    for (int u = 0; u < 64; ++u)
      ASSERT_EQ(image.at(u, v).r, u >= 32 && u < 42 && v >= 24 && v < 34 ? 200 : 0)
          << u << " " << v;
  EXPECT_NEAR(std::count(raster.keys().begin(), raster.keys().end(), 1), 200, 20);
}

TEST(Raster, TheNearestIsInFrontInAnyOrder) {
  const auto wall = [](float z, float colour) {
    return triangle_of({-9, -9, z}, {9, -9, z}, {0, 30, z}, colour);
  };
  for (const bool near_first : {false, true}) {
    Raster raster(kAhead, {});
    raster.add_triangle(wall(near_first ? 1 : 2, near_first ? 100 : 50), 1);
    raster.add_triangle(wall(near_first ? 2 : 1, near_first ? 50 : 100), 2);
    EXPECT_EQ(raster.image().at(30, 20).g, 100);
    raster.add_point({{0, 0, 0.5F}, Eigen::Array3f(7, 7, 7)}, 0.1, 3);
    EXPECT_EQ(raster.image().at(32, 24).g, 7);
    EXPECT_EQ(raster.image().at(25, 20).g, 100);
  }
}

TEST(Raster, WhatReachesBehindTheCameraIsCutOff) {
  Raster raster(kAhead, {});
  // A floor 1 m below that reaches from behind to far ahead.
  raster.add_triangle(triangle_of({-50, 1, -5}, {50, 1, -5}, {0, 1, 500}, 9), 1);
  const ColourImage image = raster.image();
  EXPECT_EQ(image.at(32, 47).r, 9);
  EXPECT_EQ(image.at(32, 30).r, 9);
  EXPECT_EQ(image.at(32, 20).r, 0) << "above the horizon";
  raster.add_triangle(triangle_of({0, 0, -1}, {1, 0, -1}, {0, 1, -2}, 1), 2);
  EXPECT_EQ(std::count(raster.keys().begin(), raster.keys().end(), 2), 0);
}

TEST(Raster, ColoursFollowThePerspective) {
  Raster raster(kAhead, {});
  // Black at 1 m, white at 3 m: half way in the world is a quarter of the way in the picture.
  std::array<RasterVertex, 3> slope = triangle_of({-1, 0, 1}, {3, 0, 3}, {-1, 0.5F, 1}, 0);
  slope[1].colour = 255;
  raster.add_triangle(slope, 1);
  const double u = 50 * 1.0 / 2 + 31.5;  // of (1, y, 2)
  EXPECT_NEAR(raster.image().at(static_cast<int>(std::lround(u)), 24).r, 127, 8);
}

TEST(ScenePicture, ARoomFromAboveShowsItsInside) {
  for (const Vec3& up : kUps) {
    const SampleScene scene = sample_scene(up);
    PictureStyle style;
    style.cut_above_m = 2.19;
    Overview options;
    options.elevation_rad = 1.3;  // over the wall, whose back the sample has, too
    const Viewpoint view = overview(scene.mesh.vertices, scene.gravity, options);
    const ScenePicture picture = draw_mesh(scene.mesh, view, scene.gravity, style);
    EXPECT_TRUE(picture.legend.empty());
    const auto boxes = testing::sample_boxes();
    const auto seen = [&](const Vec3& p_room) {
      return shade_at(picture.image, pixel_of(view, scene.T_world_room * p_room));
    };
    EXPECT_TRUE(same_hue(seen(Vec3(1.4, 1.0, 0.7)), boxes[4].colour)) << "table top";
    EXPECT_TRUE(same_hue(seen(Vec3(0.5, 0.4, 0.8)), boxes[3].colour)) << "chair";
    style.cut_above_m = 0.65;
    const ScenePicture low = draw_mesh(scene.mesh, view, scene.gravity, style);
    EXPECT_FALSE(
        same_hue(shade_at(low.image, pixel_of(view, scene.T_world_room * Vec3(1.4, 1, 0.7))),
                 boxes[4].colour));
  }
}

TEST(ScenePicture, HeightsAreRightInTheMiddleOfALargeTriangle) {
  TriangleMesh wall;  // at y = 0, from the floor up to 2 m, seen from y < 0
  for (const auto& p : {Eigen::Vector3f(-1, 0, 0), Eigen::Vector3f(1, 0, 0),
                        Eigen::Vector3f(1, 0, 2), Eigen::Vector3f(-1, 0, 2)})
    wall.vertices.push_back({p, Eigen::Vector3f(0, -1, 0), {}, {}});
  wall.triangles = {{0, 1, 2}, {0, 2, 3}};
  Viewpoint view{200, 200, 200, look_at(Vec3(0, -3, 1), Vec3(0, 0, 1), Vec3(0, 0, 1))};
  PictureStyle style;
  style.colour = PictureColour::kHeight;
  const ScenePicture picture = draw_mesh(wall, view, {}, style);
  for (const double height_m : {0.2, 0.5, 1.0, 1.4, 1.8}) {
    const Rgb8 found = shade_at(picture.image, pixel_of(view, Vec3(0.3, 0, height_m)));
    EXPECT_TRUE(same_hue(found, height_colour(height_m / 2))) << height_m;
  }
}

TEST(ScenePicture, TheLegendNamesWhatIsInSight) {
  const SampleScene scene = sample_scene(Vec3(0, -1, 0));
  Overview options;
  options.cut_above_m = 1.5;
  const Viewpoint view = overview(scene.mesh.vertices, scene.gravity, options);
  PictureStyle style;
  style.cut_above_m = options.cut_above_m;
  style.colour = PictureColour::kClass;
  const ScenePicture classes = draw_mesh(scene.mesh, view, scene.gravity, style);
  std::vector<std::string> names;
  double share = 0, last = 1;
  for (const LegendEntry& entry : classes.legend) {
    names.push_back(entry.name);
    share += entry.share;
    EXPECT_LE(entry.share, last);
    last = entry.share;
  }
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"chair", "dining table", "floor", "unknown", "wall"}));
  EXPECT_GT(share, 0.2);
  EXPECT_LT(share, 1);
  style.colour = PictureColour::kObject;
  const ScenePicture objects = draw_mesh(scene.mesh, view, scene.gravity, style, scene.objects);
  ASSERT_EQ(objects.legend.size(), 3U);
  EXPECT_EQ(objects.legend[0].name, "no object");
  EXPECT_EQ(objects.legend[1].name, "chair 3");
  EXPECT_EQ(objects.legend[2].name, "dining table 700");
  EXPECT_EQ(objects.legend[1].colour, object_colour(SceneObjectId{3}));
  style.colour = PictureColour::kHeight;
  const ScenePicture heights = draw_mesh(scene.mesh, view, scene.gravity, style);
  ASSERT_EQ(heights.legend.size(), 2U);
  EXPECT_EQ(heights.legend[0].name, "-0.10 m");
  for (const ScenePicture& picture : {classes, objects, heights})
    EXPECT_GT(with_legend(picture).width(), view.width + 50);
}

TEST(ScenePicture, PointsShowWhatTheMeshShows) {
  const SampleScene scene = sample_scene(Vec3(0.2, -1, 0.3));
  const Viewpoint view = overview(scene.mesh.vertices, scene.gravity, {320, 240});
  std::vector<SurfacePoint> dense;
  for (const auto& triangle : scene.mesh.triangles) {
    const auto& a = scene.mesh.vertices[triangle[0]];
    const auto& b = scene.mesh.vertices[triangle[1]];
    const auto& c = scene.mesh.vertices[triangle[2]];
    if (a.label.object != b.label.object) continue;
    for (float s = 0; s < 1; s += 0.01F) {
      for (float t = 0; s + t < 1; t += 0.01F) {
        dense.push_back(a);
        dense.back().p_world += s * (b.p_world - a.p_world) + t * (c.p_world - a.p_world);
      }
    }
  }
  PictureStyle style;
  style.colour = PictureColour::kClass;
  style.cut_above_m = 2.19;
  const ScenePicture mesh = draw_mesh(scene.mesh, view, scene.gravity, style);
  const ScenePicture points = draw_points(dense, view, scene.gravity, style);
  int differ = 0;
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < 320; ++u) differ += !same_hue(mesh.image.at(u, v), points.image.at(u, v));
  EXPECT_LT(differ, 0.06 * 320 * 240);
  EXPECT_TRUE(draw_points({}, view, scene.gravity, style).legend.empty());
}

TEST(Annotate, PicturesStandSideBySide) {
  const ColourImage left(40, 30, {200, 0, 0}), right(20, 10, {0, 0, 200});
  const ColourImage both = side_by_side(std::vector<CaptionedImage>{{&left, "a"}, {&right, "b"}});
  EXPECT_EQ(both.width(), 40 + 20 + 3 * 12);
  EXPECT_EQ(both.at(12, 36), (Rgb8{200, 0, 0}));
  EXPECT_EQ(both.at(12 + 40 + 12, 36), (Rgb8{0, 0, 200}));
  EXPECT_EQ(both.at(12 + 40 + 12, 36 + 20), (Rgb8{255, 255, 255}));
}

TEST(Annotate, ALegendThatDoesNotFitSaysSo) {
  ScenePicture picture{ColourImage(100, 90), PictureColour::kClass, {}};
  for (int i = 0; i < 20; ++i) picture.legend.push_back({"x", {1, 2, 3}, 0.01});
  const ColourImage image = with_legend(picture);
  EXPECT_EQ(image.height(), 90);
  EXPECT_EQ(image.at(100 + 14 + 5, 14 + 5), (Rgb8{1, 2, 3}));
}

TEST(Annotate, BoxesAndPathsAreDrawnWhereTheyAre) {
  const SampleScene scene = sample_scene(Vec3(0, -1, 0));
  const Viewpoint view = overview(scene.mesh.vertices, scene.gravity);
  ColourImage image(view.width, view.height, {255, 255, 255});
  draw_boxes(image, std::span(scene.objects).first(1), view);
  const Vec3 corner = scene.T_world_room * Vec3(0.3, 0.2, 0);
  EXPECT_EQ(shade_at(image, pixel_of(view, corner)), object_colour(SceneObjectId{3}));
  for (const ObjectState state : {ObjectState::kAbsent, ObjectState::kCandidate}) {
    SceneObject object = scene.objects.front();
    object.state = state;
    ColourImage empty(view.width, view.height, {255, 255, 255});
    draw_boxes(empty, {&object, 1}, view);
    EXPECT_EQ(shade_at(empty, pixel_of(view, corner)), (Rgb8{255, 255, 255}));
  }
  const Vec3 a = scene.T_world_room * Vec3(1, 1, 0.1), b = scene.T_world_room * Vec3(1.5, 1, 0.1);
  draw_path(image, std::vector{a, b}, view, {0, 90, 200});
  EXPECT_EQ(shade_at(image, pixel_of(view, (a + b) / 2)), (Rgb8{0, 90, 200}));
  // Behind the camera, or through it: nothing breaks.
  draw_path(image, std::vector{Vec3(view.T_camera_world.inverse() * Vec3(0, 0, -1)), a}, view, {});
}

}  // namespace
}  // namespace ygslam
