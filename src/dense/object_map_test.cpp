#include "dense/object_map.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"
#include "dense/scene_naming/object_test_world.hpp"
#include "dense/scene_naming/scene_objects.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam {
namespace {

using namespace object_test;  // NOLINT: a test

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
    expect_box(object, world.cuboids[i], kBoxTolerance_m);
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
  const auto before = named_scene(map).objects;
  map.apply({{}, {}, update.T_world_camera});
  while (map.step()) {
  }
  const auto corrected = named_scene(map).objects;
  map.finish();
  DenseMap direct(room_config(), camera);
  direct.apply(update);
  direct.finish();
  EXPECT_EQ(map.volume().fingerprint(), direct.volume().fingerprint());
  const auto after = named_scene(map).objects;
  ASSERT_EQ(after.size(), 2U);
  ASSERT_EQ(before.size(), 2U);
  ASSERT_EQ(corrected.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(before[i].id, after[i].id);
    EXPECT_EQ(corrected[i].id, after[i].id);
    expect_box(corrected[i], world.cuboids[i], kBoxTolerance_m);
    expect_box(after[i], world.cuboids[i], kBoxTolerance_m);
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

TEST(Objects, ViewsThatSeeItsSurfaceWithoutAMaskCountAgainstIt) {
  const Camera camera = room_camera();
  DenseUpdate update = seven_views(camera, two_boxes());
  for (DenseFrame& keyframe : update.added) keyframe.detections[1].score = 0.15F;
  const StaticScene always = scene_of(update, camera);
  ASSERT_EQ(always.objects.size(), 2U);
  EXPECT_NEAR(always.objects[1].probability, 0.15, 1e-5);
  EXPECT_EQ(always.objects[1].state, ObjectState::kStatic) << "unsure, but in every view";
  for (std::size_t i = 3; i < update.added.size(); ++i)
    for (auto& number : update.added[i].things) number = number == 2 ? 0 : number;
  const StaticScene now_and_then = scene_of(update, camera);
  ASSERT_EQ(now_and_then.objects.size(), 2U);
  EXPECT_NEAR(now_and_then.objects[1].probability, 3 * 0.15 / 7, 1e-5);
  EXPECT_EQ(now_and_then.objects[1].state, ObjectState::kCandidate) << "in three of seven";
  for (const SurfacePoint& vertex : now_and_then.mesh.vertices)
    ASSERT_NE(vertex.label.object, now_and_then.objects[1].id);
}

TEST(Objects, MovesWhereMostPointsOnItDo) {
  const Camera camera = room_camera();
  DenseUpdate update = seven_views(camera, two_boxes());
  for (DenseFrame& keyframe : update.added) {
    keyframe.movers = GreyImage(camera.width(), camera.height());
    const auto pixels = std::count(keyframe.things.begin(), keyframe.things.end(), 2);
    std::ptrdiff_t seen = 0;
    for (std::size_t i = 0; i < keyframe.movers.size(); ++i)  // its upper half
      if (keyframe.things.begin()[i] == 2 && ++seen < pixels / 2) keyframe.movers.begin()[i] = 255;
    keyframe.motion_votes = {{0, 0}, {2, 1}};
  }
  EXPECT_EQ(scene_of(update, camera).objects.size(), 1U) << "what moves adds no surface";
  for (DenseFrame& keyframe : update.added) keyframe.motion_votes = {{0, 0}, {0, 0}};
  EXPECT_EQ(scene_of(update, camera).objects.size(), 1U) << "without points the pixels tell";
  for (DenseFrame& keyframe : update.added) keyframe.motion_votes = {{0, 0}, {2, 2}};
  EXPECT_EQ(scene_of(update, camera).objects.size(), 2U);
}

TEST(Objects, WhatIsExcludedIsNone) {
  const Camera camera = room_camera();
  DenseUpdate update = seven_views(camera, two_boxes());
  for (DenseFrame& keyframe : update.added) {
    keyframe.movers = GreyImage(camera.width(), camera.height());
    for (std::size_t i = 0; i < keyframe.movers.size(); ++i)
      keyframe.movers.begin()[i] = keyframe.things.begin()[i] == 2 ? 255 : 0;
    keyframe.detections[1].semantic_class = kDog;
  }
  const StaticScene scene = scene_of(update, camera);
  ASSERT_EQ(scene.objects.size(), 1U);
  EXPECT_EQ(scene.objects[0].semantic_class, kChair);
}

TEST(Objects, NearTheEdgesOfMasksItIsNotSureWhatAPixelShows) {
  const Camera camera = room_camera();
  DenseUpdate update = seven_views(camera, two_boxes());
  const GreyImage things = update.added.front().things;
  update.added.resize(1);
  update.added.front().edge_px = 2;
  const GreyImage inner = without_edges(things, 2);
  DenseMap map(room_config(), camera);
  map.apply(update);
  const DepthView view = map.saved().front().view->restored();
  int unsure = 0;
  for (std::size_t i = 0; i < things.size(); ++i) {
    const std::uint8_t object = view.object.begin()[i];
    if (things.begin()[i] == 0) {
      ASSERT_EQ(object, DepthView::kNothing);
    } else if (inner.begin()[i] == 0) {
      ASSERT_EQ(object, DepthView::kUnsure);
      ++unsure;
    }
  }
  EXPECT_GT(unsure, 300);
}

TEST(Objects, WhatIsTooSmallToBeOneIsNoVoteAgainstIt) {
  const Camera camera = room_camera();
  DenseUpdate update = seven_views(camera, two_boxes());
  update.added.resize(1);
  GreyImage& things = update.added.front().things;
  int left = 4;  // pixels of the second
  for (std::uint8_t& number : things)
    if (number == 2 && left-- <= 0) number = 0;
  DenseMap map(room_config(), camera);
  map.apply(update);
  const DepthView view = map.saved().front().view->restored();
  EXPECT_EQ(std::count(view.object.begin(), view.object.end(), DepthView::kUnsure), 4);
}

/// A patch of a wall, so many cells wide, from x = first_m on.
ObjectObservation patch(SemanticClass semantic_class, double first_m, double width_m) {
  ObjectObservation view{{semantic_class, 0.9F}, {}};
  for (double x = first_m; x < first_m + width_m; x += 0.025)
    for (double y = 0; y < 0.5; y += 0.025)
      view.p_camera.emplace_back(static_cast<float>(x), static_cast<float>(y), 2.01F);
  return view;
}

TEST(ObjectMap, TwoOfAClassSideBySideAreTwo) {
  ObjectMap map;
  for (int i = 0; i < 5; ++i) {
    const ObjectObservation views[] = {patch(kScreen, 0, 0.5), patch(kScreen, 0.6, 0.5)};
    const auto ids = map.step(views, SE3(), Timestamp{i});
    EXPECT_EQ(ids, (std::vector{SceneObjectId{1}, SceneObjectId{2}}));
  }
  EXPECT_EQ(map.objects().size(), 2U);
}

TEST(ObjectMap, ABoxHoldsThePartsOfWhatIsPartedButNotALeak) {
  ObjectMap map;
  ObjectObservation view = patch(coco_class(60), 0, 0.6);  // something stands before the middle
  for (const auto& [first_m, width_m] : {std::pair{0.9, 0.3}, {1.8, 0.1}})
    for (const Eigen::Vector3f& p : patch(coco_class(60), first_m, width_m).p_camera)
      view.p_camera.push_back(p);
  for (int i = 0; i < 5; ++i) map.step({&view, 1}, SE3(), Timestamp{i});
  TriangleMesh mesh;
  SpaceCells space;
  const auto objects = place_objects(map, {Vec3(0, -1, 0), -1.2}, mesh, space);
  ASSERT_EQ(objects.size(), 1U);
  EXPECT_NEAR(objects[0].box.size_m.head<2>().maxCoeff(), 1.2, 0.04);
}

TEST(ObjectMap, ABookOnATableIsNoPartOfIt) {
  ObjectMap map;
  for (int i = 0; i < 5; ++i) {
    const ObjectObservation views[] = {patch(coco_class(60), 0, 1.5),
                                       patch(coco_class(73), 0.5, 0.2)};
    const auto ids = map.step(views, SE3(), Timestamp{i});
    EXPECT_EQ(ids, (std::vector{SceneObjectId{1}, SceneObjectId{2}}));
  }
}

TEST(ObjectMap, TwoPartsAreOneOnceAViewShowsThemTogether) {
  ObjectMap map;
  const ObjectObservation left = patch(kChair, 0, 0.4), right = patch(kChair, 0.6, 0.3);
  map.step({&left, 1}, SE3(), Timestamp{0});
  const auto second = map.step({&right, 1}, SE3(), Timestamp{1});
  EXPECT_EQ(second.front(), SceneObjectId{2});
  const ObjectObservation both = patch(kChair, 0, 0.9);
  const auto third = map.step({&both, 1}, SE3(), Timestamp{2});
  EXPECT_EQ(third.front(), SceneObjectId{1});
  EXPECT_EQ(map.current(SceneObjectId{2}), SceneObjectId{1});
  ASSERT_EQ(map.objects().size(), 1U);
  EXPECT_EQ(map.objects().begin()->second.views(), 3);
}

TEST(ObjectMap, APartThatHardlyAnyViewShowedIsWorthAViewAndThenBelieved) {
  ObjectMap map;
  const std::vector<ObjectObservation> part = {patch(kChair, 0, 0.4)},
                                       whole = {patch(kChair, 0, 0.7)};
  std::int64_t at = 0;
  while (at < 40) map.step(part, SE3(), Timestamp{at++});
  EXPECT_FALSE(map.is_poorly_known(part, SE3(), 6));
  const auto width_m = [&] {
    Eigen::AlignedBox3d extent;
    for (const Vec3& p : map.objects().at(SceneObjectId{1}).surface_world()) extent.extend(p);
    return extent.sizes().x();
  };
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(width_m(), 0.4, 0.05);
    EXPECT_TRUE(map.is_poorly_known(whole, SE3(), 6)) << i;
    map.step(whole, SE3(), Timestamp{at++});
  }
  EXPECT_FALSE(map.is_poorly_known(whole, SE3(), 6));
  EXPECT_NEAR(width_m(), 0.7, 0.05) << "forty views of half of it do not outweigh it";
}

TEST(ObjectMap, WhatNoViewOfTheMapShowsIsForgotten) {
  ObjectMap map;
  const std::vector<ObjectObservation> chair = {patch(kChair, 0, 0.4)};
  for (std::int64_t i = 1; i <= 3; ++i) map.step(chair, SE3(), Timestamp{i});
  map.forget(Timestamp{1});
  map.forget(Timestamp{3});
  ASSERT_EQ(map.objects().size(), 1U);
  EXPECT_EQ(map.objects().begin()->second.views(), 1);
  map.forget(Timestamp{7});
  map.forget(Timestamp{2});
  EXPECT_TRUE(map.objects().empty());
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

TEST(Objects, AViewThatShowsACellBesideAnObjectsIsOfItInEveryDirection) {
  ObjectMapConfig config;
  const Vec3 p = config.cell_m * Vec3(-20.5, -0.5, 40.5);
  const auto object_of = [&](ObjectMap& map, const Vec3& p_world, int stamp) {
    ObjectObservation view;
    view.detection.semantic_class = kChair;
    view.detection.score = 0.8F;
    view.p_camera = {p_world.cast<float>()};
    return map.step({&view, 1}, SE3(), Timestamp{stamp}).at(0);
  };
  for (int n = 0; n < 27; ++n) {
    const Eigen::Vector3i steps(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    const Vec3 step = config.cell_m * steps.cast<double>();
    ObjectMap beside(config), apart(config);
    EXPECT_EQ(object_of(beside, p, 1), object_of(beside, p + step, 2)) << step.transpose();
    if (step.isZero()) continue;
    EXPECT_NE(object_of(apart, p, 1), object_of(apart, p + 2 * step, 2)) << step.transpose();
  }
}

TEST(CellKey, ItsCellHoldsThePoint) {
  Rng rng(3);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p = random_normals<3>(rng, 30);
    const Vec3 low = low_corner(cell_key(p, 0.05), 0.05);
    ASSERT_TRUE((low.array() <= p.array() + 1e-9).all() && (p.array() < low.array() + 0.05).all());
  }
}

}  // namespace
}  // namespace ygslam
