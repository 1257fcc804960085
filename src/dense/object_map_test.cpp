#include "dense/object_map.hpp"

#include <gtest/gtest.h>

#include "dense/dense_map.hpp"
#include "scene/floor_frame.hpp"
#include "volume/volume_test_world.hpp"

namespace ygslam {
namespace {

using volume_test::look_at;
using volume_test::World;

// Masks end a pixel inside the edges (2 cm, more on a flat face), voxels round them.
constexpr double kBoxToleranceM = 0.08;
constexpr SemanticClass kChair = coco_class(56), kScreen = coco_class(62), kDog = coco_class(16);

Camera room_camera() {
  CameraConfig c;
  c.fx = c.fy = 150, c.cx = 95.5, c.cy = 71.5, c.width = 192, c.height = 144;
  return Camera(c);
}

DenseMapConfig room_config() {
  DenseMapConfig config;
  config.edge_px = 1;  // of so small an image
  return config;
}

/// A room with its floor at y = 1.2 m and two boxes on it; their numbers are what `detections`
/// says.
World two_boxes() {
  World world;
  world.low = Vec3(-2, -1.3, -2);
  world.high = Vec3(2, 1.2, 2);
  world.cuboids = {{Vec3(-0.8, 0.7, -0.3), Vec3(-0.3, 1.2, 0.4), SceneObjectId{1}, {200, 40, 40}},
                   {Vec3(0.4, 0.4, -0.2), Vec3(1.0, 1.2, 0.1), SceneObjectId{2}, {40, 40, 200}}};
  return world;
}

/// A view of it, with perfect masks.
DenseKeyframe keyframe_of(const World& world, const Camera& camera, std::uint32_t id,
                          const SE3& T_world_camera, std::vector<Detection> detections) {
  auto frame = std::make_shared<RgbdFrame>();
  frame->id = FrameId{id};
  frame->stamp = Timestamp{1000 + id};
  frame->colour = ColourImage(camera.width(), camera.height());
  frame->depth_m = DepthImage(camera.width(), camera.height());
  DenseKeyframe keyframe{
      KeyframeId{id},       frame, {}, {}, GreyImage(camera.width(), camera.height()),
      std::move(detections)};
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const Vec3 ray = camera.unproject({u, v}, 1.0);
      const auto seen = world.look(T_world_camera.t(), T_world_camera.R() * ray);
      frame->depth_m.at(u, v) = static_cast<float>(seen.distance_m);
      frame->colour.at(u, v) = seen.colour;
      keyframe.things.at(u, v) = static_cast<std::uint8_t>(seen.object);
    }
  }
  return keyframe;
}

SE3 view_pose(std::uint32_t i) {
  const double angle = -0.9 + 0.3 * i;
  return look_at(Vec3(1.7 * std::sin(angle), -0.5, -1.7 * std::cos(angle)), Vec3(0.1, 0.7, 0));
}

/// Seven views from one side to the other; in two of them the chair is taken for a couch.
DenseUpdate seven_views(const Camera& camera, const World& world) {
  DenseUpdate update;
  for (std::uint32_t i = 0; i < 7; ++i) {
    const Detection first{i == 1 || i == 4 ? coco_class(57) : kChair, 0.8F};
    update.added.push_back(keyframe_of(world, camera, i, view_pose(i), {first, {kScreen, 0.6F}}));
    update.T_world_camera[KeyframeId{i}] = view_pose(i);
  }
  return update;
}

/// Corners of the box are those of the cuboid, whatever its axes are called.
void expect_box(const SceneObject& object, const volume_test::Cuboid& truth, double tolerance_m) {
  Vec3 low = Vec3::Constant(1e9), high = -low;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 side((corner & 1) - 0.5, (corner >> 1 & 1) - 0.5, (corner >> 2) - 0.5);
    const Vec3 p = object.box.T_world_box * side.cwiseProduct(object.box.size_m);
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  EXPECT_LT((low - truth.low).cwiseAbs().maxCoeff(), tolerance_m) << low.transpose();
  EXPECT_LT((high - truth.high).cwiseAbs().maxCoeff(), tolerance_m) << high.transpose();
}

StaticScene scene_of(const DenseUpdate& update, const Camera& camera) {
  DenseMap map(room_config(), camera);
  map.apply(update);
  map.finish();
  return map.scene();
}

TEST(Objects, TwoBoxesAreTwoObjectsWithTheirClassesAndBoxes) {
  const Camera camera = room_camera();
  const World world = two_boxes();
  const StaticScene scene = scene_of(seven_views(camera, world), camera);
  ASSERT_EQ(scene.objects.size(), 2U);
  const SemanticClass classes[] = {kChair, kScreen};
  for (std::size_t i = 0; i < 2; ++i) {
    const SceneObject& object = scene.objects[i];
    EXPECT_EQ(object.semantic_class, classes[i]) << "a minority of views is outvoted";
    EXPECT_EQ(object.state, ObjectState::kStatic);
    EXPECT_EQ(object.views, 7);
    EXPECT_EQ(object.first_seen.ns, 1000);
    EXPECT_EQ(object.last_seen.ns, 1006);
    expect_box(object, world.cuboids[i], kBoxToleranceM);
  }
  EXPECT_NEAR(scene.objects[0].probability, 5 * 0.8 / 7, 1e-5);
  EXPECT_NEAR(scene.objects[1].probability, 0.6, 1e-5);
  int labelled = 0;
  for (const SurfacePoint& vertex : scene.mesh.vertices) {
    if (vertex.label.object == kNoSceneObject) continue;
    ++labelled;
    const std::size_t i = vertex.label.object == scene.objects[0].id ? 0 : 1;
    ASSERT_EQ(vertex.label.semantic_class, classes[i]);
    const volume_test::Cuboid& truth = world.cuboids[i];
    const Vec3 p = vertex.p_world.cast<double>();
    ASSERT_LT((p - p.cwiseMax(truth.low).cwiseMin(truth.high)).norm(), 0.05);
  }
  EXPECT_GT(labelled, 1000);
  int chair_cells = 0;
  for (const SpaceCell& cell : scene.space.cells)
    chair_cells += cell.label.semantic_class == kChair ? 1 : 0;
  EXPECT_GT(chair_cells, 50);
}

TEST(Objects, KeepTheirNumbersWhenPosesAreCorrectedAndComeOutAsMadeAtOnce) {
  const Camera camera = room_camera();
  const World world = two_boxes();
  DenseUpdate update = seven_views(camera, world);
  // The map drifts while it is made, and is corrected later.
  DenseUpdate drifted = update;
  for (auto& [id, T_world_camera] : drifted.T_world_camera)
    T_world_camera = SE3(Mat3::Identity(), Vec3(0.06 * index(id), 0, 0)) * T_world_camera;
  DenseMap map(room_config(), camera);
  map.apply(drifted);
  while (map.step()) {
  }
  const auto before = map.scene().objects;
  map.apply({{}, {}, update.T_world_camera});
  while (map.step()) {
  }
  const auto corrected = map.scene().objects;
  map.finish();
  DenseMap direct(room_config(), camera);
  direct.apply(update);
  direct.finish();
  EXPECT_EQ(map.volume().fingerprint(), direct.volume().fingerprint());
  const auto after = map.scene().objects;
  ASSERT_EQ(after.size(), 2U);
  ASSERT_EQ(before.size(), 2U);
  ASSERT_EQ(corrected.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(before[i].id, after[i].id);
    EXPECT_EQ(corrected[i].id, after[i].id);
    expect_box(corrected[i], world.cuboids[i], kBoxToleranceM);
    expect_box(after[i], world.cuboids[i], kBoxToleranceM);
  }
}

TEST(Objects, SeenOnceOrTwiceAreCandidatesAndNameNoSurface) {
  const Camera camera = room_camera();
  const World world = two_boxes();
  DenseUpdate update = seven_views(camera, world);
  for (std::size_t i = 2; i < update.added.size(); ++i) {
    for (auto& number : update.added[i].things) number = number == 2 ? 0 : number;
  }
  // Else the votes of the five views that do not show it win.
  update.added.erase(update.added.begin() + 3, update.added.end());
  const StaticScene scene = scene_of(update, camera);
  ASSERT_EQ(scene.objects.size(), 2U);
  EXPECT_EQ(scene.objects[0].state, ObjectState::kStatic);
  EXPECT_EQ(scene.objects[1].state, ObjectState::kCandidate);
  for (const SurfacePoint& vertex : scene.mesh.vertices)
    ASSERT_NE(vertex.label.object, scene.objects[1].id);
}

TEST(Objects, WhatIsExcludedIsNone) {
  const Camera camera = room_camera();
  DenseUpdate update = seven_views(camera, two_boxes());
  for (DenseKeyframe& keyframe : update.added) {
    keyframe.movers = GreyImage(camera.width(), camera.height());
    for (std::size_t i = 0; i < keyframe.movers.size(); ++i)
      keyframe.movers.begin()[i] = keyframe.things.begin()[i] == 2 ? 255 : 0;
    keyframe.detections[1].semantic_class = kDog;
  }
  const StaticScene scene = scene_of(update, camera);
  ASSERT_EQ(scene.objects.size(), 1U);
  EXPECT_EQ(scene.objects[0].semantic_class, kChair);
}

/// A patch of a wall, so many cells wide, from x = first_m on.
ThingView patch(SemanticClass semantic_class, double first_m, double width_m) {
  ThingView view{{semantic_class, 0.9F}, {}};
  for (double x = first_m; x < first_m + width_m; x += 0.025)
    for (double y = 0; y < 0.5; y += 0.025)
      view.p_camera.emplace_back(static_cast<float>(x), static_cast<float>(y), 2.01F);
  return view;
}

TEST(ObjectMap, TwoOfAClassSideBySideAreTwo) {
  ObjectMap map;
  for (int i = 0; i < 5; ++i) {
    const ThingView views[] = {patch(kScreen, 0, 0.5), patch(kScreen, 0.6, 0.5)};
    const auto ids = map.step(views, SE3(), Timestamp{i});
    EXPECT_EQ(ids, (std::vector{SceneObjectId{1}, SceneObjectId{2}}));
  }
  EXPECT_EQ(map.objects().size(), 2U);
}

TEST(ObjectMap, ABookOnATableIsNoPartOfIt) {
  ObjectMap map;
  for (int i = 0; i < 5; ++i) {
    const ThingView views[] = {patch(coco_class(60), 0, 1.5), patch(coco_class(73), 0.5, 0.2)};
    const auto ids = map.step(views, SE3(), Timestamp{i});
    EXPECT_EQ(ids, (std::vector{SceneObjectId{1}, SceneObjectId{2}}));
  }
}

TEST(ObjectMap, TwoPartsAreOneOnceAViewShowsThemTogether) {
  ObjectMap map;
  const ThingView left = patch(kChair, 0, 0.4), right = patch(kChair, 0.6, 0.3);
  map.step({&left, 1}, SE3(), Timestamp{0});
  const auto second = map.step({&right, 1}, SE3(), Timestamp{1});
  EXPECT_EQ(second.front(), SceneObjectId{2});
  const ThingView both = patch(kChair, 0, 0.9);
  const auto third = map.step({&both, 1}, SE3(), Timestamp{2});
  EXPECT_EQ(third.front(), SceneObjectId{1});
  EXPECT_EQ(map.current(SceneObjectId{2}), SceneObjectId{1});
  ASSERT_EQ(map.objects().size(), 1U);
  EXPECT_EQ(map.objects().begin()->second.views(), 3);
}

TEST(ThingViews, ErosionKeepsTheSquaresInsideAndTheBorder) {
  GreyImage ids(9, 7, 1);
  for (int v = 0; v < 7; ++v) ids.at(4, v) = 2;
  const GreyImage inner = eroded(ids, 1);
  for (int v = 0; v < 7; ++v)
    for (int u = 0; u < 9; ++u) EXPECT_EQ(inner.at(u, v), u < 3 || u > 5 ? 1 : 0) << u;
}

TEST(ThingViews, SmallOnesKeepTheirEdges) {
  GreyImage ids(60, 40);
  for (int v = 2; v < 38; ++v)
    for (int u = 2; u < 38; ++u) ids.at(u, v) = 1;
  for (int v = 10; v < 16; ++v)
    for (int u = 45; u < 51; ++u) ids.at(u, v) = 2;
  const GreyImage inner = without_edges(ids, 2);
  EXPECT_EQ(std::count(inner.begin(), inner.end(), 1), 32 * 32);
  EXPECT_EQ(std::count(inner.begin(), inner.end(), 2), 6 * 6);
}

}  // namespace
}  // namespace ygslam
