#include "dense/scene_naming/named_scene.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <set>

#include "dense/scene_naming/object_numbers.hpp"
#include "dense/scene_naming/object_test_world.hpp"
#include "geometry/properties_testing.hpp"

namespace ygslam {
namespace {

using namespace object_test;  // NOLINT: a test

/// The two boxes, and a table that no mask shows.
World boxes_and_table() {
  World world = two_boxes();
  world.cuboids.push_back(
      {Vec3(-0.9, 0.45, 0.9), Vec3(0.7, 0.5, 1.8), kNoSceneObject, {150, 110, 60}});
  return world;
}

DenseMap map_of(const World& world, const Camera& camera) {
  DenseUpdate update = seven_views(camera, world);
  for (std::uint32_t i = 0; i < 4; ++i) {  // which look down on the table
    const SE3 above = look_at(Vec3(0.6 * i - 1, -1.1, 0.2), Vec3(-0.1, 0.5, 1.5));
    update.added.push_back(
        keyframe_of(world, camera, 7 + i, above, {{kChair, 0.8F}, {kScreen, 0.6F}}));
    update.T_world_camera[KeyframeId{7 + i}] = above;
  }
  DenseMap map(room_config(), camera);
  map.apply(update);
  map.finish();
  return map;
}

const SceneObject* table_of(const StaticScene& scene) {
  const auto at = std::find_if(scene.objects.begin(), scene.objects.end(), [](const auto& object) {
    return object.semantic_class == coco_class(60);
  });
  return at == scene.objects.end() ? nullptr : &*at;
}

TEST(NamedScene, NumbersBeginAtOneTablesIncluded) {
  const Camera camera = room_camera();
  DenseMap map = map_of(boxes_and_table(), camera);
  const StaticScene scene = named_scene(map);
  ASSERT_EQ(scene.objects.size(), 3U);
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    EXPECT_EQ(static_cast<std::size_t>(scene.objects[i].id), i + 1);
  const SceneObject* table = table_of(scene);
  ASSERT_NE(table, nullptr);
  EXPECT_GE(table->views, 4);
  EXPECT_EQ(table->last_seen.ns, 1010);
  int of_table = 0;
  for (const SurfacePoint& vertex : scene.mesh.vertices) {
    ASSERT_LE(static_cast<std::size_t>(vertex.label.object), scene.objects.size());
    of_table += vertex.label.object == table->id ? 1 : 0;
    if (vertex.label.object == kNoSceneObject) continue;
    const std::size_t i = static_cast<std::size_t>(vertex.label.object) - 1;
    ASSERT_EQ(vertex.label.semantic_class, scene.objects[i].semantic_class);
  }
  EXPECT_GT(of_table, 500);
  for (const SpaceCell& cell : scene.space.cells)
    ASSERT_LE(static_cast<std::size_t>(cell.label.object), scene.objects.size());
}

TEST(NamedScene, ReadsTheMapAndLeavesItAsItIs) {
  const Camera camera = room_camera();
  DenseMap map = map_of(two_boxes(), camera);
  const std::uint64_t before = map.volume().fingerprint();
  const StaticScene once = named_scene(map), twice = named_scene(map);
  EXPECT_EQ(map.volume().fingerprint(), before);
  ASSERT_EQ(once.mesh.vertices.size(), twice.mesh.vertices.size());
  EXPECT_EQ(once.mesh.triangles, twice.mesh.triangles);
  for (std::size_t i = 0; i < once.mesh.vertices.size(); ++i)
    ASSERT_EQ(once.mesh.vertices[i].label.object, twice.mesh.vertices[i].label.object);
  EXPECT_EQ(once.objects.size(), twice.objects.size());
}

TEST(NamedScene, OfNothingIsEmpty) {
  const Camera camera = room_camera();
  DenseMap map(room_config(), camera);
  const StaticScene scene = named_scene(map);
  EXPECT_TRUE(scene.mesh.vertices.empty());
  EXPECT_TRUE(scene.objects.empty());
  EXPECT_TRUE(labelled_mesh(named_mesh(map)).vertices.empty());
}

TEST(NamedScene, TheQuickMeshHasTheClassesOfTheScene) {
  const Camera camera = room_camera();
  DenseMap map = map_of(boxes_and_table(), camera);
  const TriangleMesh quick = labelled_mesh(named_mesh(map));
  const StaticScene scene = named_scene(map);
  ASSERT_EQ(quick.vertices.size(), scene.mesh.vertices.size());
  std::size_t same = 0;
  for (std::size_t i = 0; i < quick.vertices.size(); ++i)
    same += quick.vertices[i].label.semantic_class == scene.mesh.vertices[i].label.semantic_class;
  EXPECT_GT(same, 95 * quick.vertices.size() / 100) << "but for edges, which ask the views";
}

RC_GTEST_PROP(ObjectNumbersProperty, LabelsNameTheSameObjectsAsBefore, ()) {
  StaticScene scene;
  const auto ids =
      *rc::gen::unique<std::vector<std::uint16_t>>(rc::gen::inRange<std::uint16_t>(1, 0xffff));
  for (const std::uint16_t id : ids) {
    SceneObject object;
    object.id = SceneObjectId{id};
    object.views = id;  // by which it is known again
    object.state = *rc::gen::arbitrary<bool>() ? ObjectState::kStatic : ObjectState::kCandidate;
    scene.objects.push_back(object);
    scene.mesh.vertices.push_back({});
    scene.mesh.vertices.back().label.object = object.id;
  }
  scene.mesh.vertices.push_back({});  // of none
  scene.space.cells.resize(scene.mesh.vertices.size());
  for (std::size_t i = 0; i < scene.space.cells.size(); ++i)
    scene.space.cells[i].label = scene.mesh.vertices[i].label;
  number_objects(scene);
  bool is_candidate = false;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    RC_ASSERT(static_cast<std::size_t>(scene.objects[i].id) == i + 1);
    RC_ASSERT(!is_candidate || scene.objects[i].state == ObjectState::kCandidate);
    is_candidate = scene.objects[i].state == ObjectState::kCandidate;
    const auto number = static_cast<std::size_t>(scene.mesh.vertices[i].label.object);
    RC_ASSERT(scene.objects[number - 1].views == ids[i]);
    RC_ASSERT(scene.space.cells[i].label.object == scene.mesh.vertices[i].label.object);
  }
  RC_ASSERT(scene.mesh.vertices.back().label.object == kNoSceneObject);
}

}  // namespace
}  // namespace ygslam
