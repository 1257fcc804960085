// Frames between keyframes: which of them the dense map takes, and how long it keeps them.
#include <gtest/gtest.h>

#include "dense/scene_naming/object_test_world.hpp"

namespace ygslam {
namespace {

using object_test::kChair;
using object_test::kScreen;
using volume_test::World;

constexpr KeyframeId kAnchor{3};

/// Keyframes 0 to 6, one each second, of a room with a chair and a screen.
struct KnownRoom {
  Camera camera = object_test::room_camera();
  World world = object_test::two_boxes();
  DenseMap map;
  std::map<KeyframeId, SE3> poses;

  explicit KnownRoom(const DenseMapConfig& config = object_test::room_config(),
                     const std::vector<volume_test::Cuboid>& more = {}, bool is_watched = true)
      : map(config, camera) {
    if (is_watched) map.expect_looks();
    world.cuboids.insert(world.cuboids.end(), more.begin(), more.end());
    DenseUpdate update;
    for (std::uint32_t i = 0; i < 7; ++i) {
      poses[KeyframeId{i}] = object_test::view_pose(i);
      update.added.push_back(object_test::keyframe_of(
          world, camera, i, poses[KeyframeId{i}], {{kChair, 0.8F}, {kScreen, 0.6F}}, stamp_of(i)));
    }
    give(std::move(update));
  }

  static Timestamp stamp_of(double t_s) { return {static_cast<std::int64_t>(1e9 * t_s)}; }

  void give(DenseUpdate update) {
    update.T_world_camera = poses;
    map.apply(update);
    while (map.step()) {
    }
  }
  /// A frame that is no keyframe, of the world as it is now.
  void look(const SE3& T_world_camera, double t_s, std::uint32_t newest = 6) {
    DenseFrame frame = object_test::keyframe_of(world, camera, newest, T_world_camera,
                                                {{kChair, 0.8F}, {kScreen, 0.6F}}, stamp_of(t_s));
    frame.anchor = DenseAnchor{kAnchor, stamp_of(3), T_world_camera.inverse() * poses.at(kAnchor)};
    DenseUpdate update;
    update.added.push_back(std::move(frame));
    give(std::move(update));
  }
  /// A keyframe more.
  void keyframe(std::uint32_t id, const SE3& T_world_camera, double t_s) {
    DenseUpdate update;
    poses[KeyframeId{id}] = T_world_camera;
    update.added.push_back(object_test::keyframe_of(
        world, camera, id, T_world_camera, {{kChair, 0.8F}, {kScreen, 0.6F}}, stamp_of(t_s)));
    give(std::move(update));
  }
  void take_chair_away() { world.cuboids.erase(world.cuboids.begin()); }

  /// Of the views that the map has, all at once: for any number of threads the same map.
  void expect_pure() {
    map.finish();
    for (const int threads : {1, 2, 4}) {
      DenseMapConfig config = map.config();
      config.volume.threads = threads;
      DenseMap again(config, camera);
      again.restore(map.saved());
      again.apply({{}, {}, poses});
      again.finish();
      EXPECT_EQ(again.volume().fingerprint(), map.volume().fingerprint()) << threads;
      EXPECT_EQ(named_scene(again).objects.size(), named_scene(map).objects.size());
    }
  }
};

const SceneObject* chair_of(const StaticScene& scene) {
  const auto at = std::find_if(scene.objects.begin(), scene.objects.end(),
                               [](const auto& object) { return object.semantic_class == kChair; });
  return at == scene.objects.end() ? nullptr : &*at;
}

/// Of a part of the room that no keyframe shows.
SE3 new_view() { return volume_test::look_at(Vec3(0, -0.5, -1), Vec3(0, -0.2, -1.9)); }

TEST(DenseFrames, WhatShowsNothingNewIsDropped) {
  KnownRoom room;
  for (int i = 0; i < 5; ++i) room.look(object_test::view_pose(3), 7 + 0.5 * i);
  EXPECT_EQ(room.map.volume().views(), 7);
  EXPECT_EQ(room.map.saved().size(), 7U);
  room.expect_pure();
}

TEST(DenseFrames, WhatShowsSomethingNewStaysUntilItWasSeenOftenEnough) {
  KnownRoom room;
  for (int i = 0; i < 8; ++i) room.look(new_view(), 7 + 0.5 * i);
  const int taken = room.map.volume().views() - 7;
  EXPECT_EQ(taken, room.map.config().reading.min_views);
  room.expect_pure();
}

TEST(DenseFrames, MoveWithTheirKeyframeAndOutliveIt) {
  KnownRoom room;
  room.look(new_view(), 7);
  room.look(new_view(), 7.5);
  const auto place_of_last = [&] { return room.map.views().back().T_world_camera; };
  const SE3 before = place_of_last();
  const SE3 shift(so3_exp(Vec3(0, 0.1, 0)), Vec3(0.3, 0, -0.2));
  for (auto& [id, T_world_camera] : room.poses) T_world_camera = shift * T_world_camera;
  room.give({});
  EXPECT_LT(((shift * before).t() - place_of_last().t()).norm(), 1e-9);

  const KeyframeId next{4};
  DenseUpdate update;
  update.removed = {
      {kAnchor,
       {next, KnownRoom::stamp_of(4), room.poses.at(kAnchor).inverse() * room.poses.at(next)}}};
  room.poses.erase(kAnchor);
  room.give(std::move(update));
  EXPECT_EQ(room.map.volume().views(), 9) << "what they show stays";
  room.poses.at(next) = shift * room.poses.at(next);
  room.give({});
  EXPECT_LT(((shift * shift * before).t() - place_of_last().t()).norm(), 1e-9);
  room.expect_pure();
}

TEST(DenseFrames, ACameraThatStandsSeesAThingGoAtOnce) {
  KnownRoom room;
  room.take_chair_away();
  for (int i = 0; i < 40; ++i) room.look(object_test::view_pose(3), 7 + 0.5 * i);
  const StaticScene scene = named_scene(room.map);
  const SceneObject* chair = chair_of(scene);
  ASSERT_TRUE(chair);
  EXPECT_EQ(chair->state, ObjectState::kAbsent);
  ASSERT_TRUE(chair->found_empty);
  EXPECT_LE(chair->found_empty->ns, KnownRoom::stamp_of(7.5).ns);
  EXPECT_LE(room.map.volume().views(), 7 + 4) << "no more of the same";
  room.expect_pure();
  EXPECT_EQ(chair_of(named_scene(room.map))->state, ObjectState::kAbsent);
}

const volume_test::Cuboid carton{
    Vec3(-0.15, 0.8, -0.6), Vec3(0.25, 1.2, -0.3), kNoSceneObject, {120, 90, 40}};

/// Vertices of the carton.
std::ptrdiff_t left_of_it(DenseMap& map, const volume_test::Cuboid& it = carton) {
  const TriangleMesh mesh = map.mesh();
  return std::count_if(mesh.vertices.begin(), mesh.vertices.end(), [&](const SurfacePoint& p) {
    const Vec3 floor_m(0, 0.1, 0);  // what lies on the floor is the floor
    return Eigen::AlignedBox3d(it.low - Vec3::Constant(0.03), it.high - floor_m)
        .contains(p.p_world.cast<double>());
  });
}

TEST(DenseFrames, ViewsFarApartTellWhatWent) {
  KnownRoom room(object_test::room_config(), {carton});
  room.world.cuboids.pop_back();
  for (int i = 0; i < 3; ++i) room.look(object_test::view_pose(2 + i), 8 + 12.0 * i);
  EXPECT_LT(left_of_it(room.map), 10) << "those that decide are not culled before they do";
  room.expect_pure();
  EXPECT_LT(left_of_it(room.map), 10);
}

TEST(DenseFrames, AKeyframeWithoutAPlaceComesBackWhereItBelongs) {
  KnownRoom room(object_test::room_config(), {carton});
  room.world.cuboids.pop_back();
  for (int i = 0; i < 3; ++i) room.look(object_test::view_pose(2 + i), 7.5 + 0.5 * i);
  ASSERT_LT(left_of_it(room.map), 10);
  const auto all = room.poses;
  room.poses = {*all.rbegin()};
  room.give({});
  const SE3 shift(Mat3::Identity(), Vec3(0.31, 0, 0.17));
  for (const auto& [id, T_world_camera] : all) room.poses[id] = shift * T_world_camera;
  room.give({});
  const auto live = static_cast<double>(room.map.mesh().vertices.size());
  room.expect_pure();
  EXPECT_NEAR(live, static_cast<double>(room.map.mesh().vertices.size()), 0.01 * live)
      << "nothing is taken back at the places where it stood before";
}

TEST(DenseFrames, ACameraThatStandsSeesGoWhatNobodyNamed) {
  KnownRoom room(object_test::room_config(), {carton});
  ASSERT_GT(left_of_it(room.map), 300);
  room.look(object_test::view_pose(3), 7);
  EXPECT_GT(left_of_it(room.map), 300) << "a single view may be wrong";
  room.world.cuboids.pop_back();
  for (int i = 0; i < 3; ++i) room.look(object_test::view_pose(2 + i), 7.5 + 0.5 * i);
  EXPECT_LT(left_of_it(room.map), 10) << "seven views saw it, three look through";
  const int views = room.map.volume().views();
  for (int i = 0; i < 20; ++i) room.look(object_test::view_pose(3), 9 + 0.5 * i);
  EXPECT_LE(room.map.volume().views(), views + 1) << "no more of the same";
  room.expect_pure();
  EXPECT_LT(left_of_it(room.map), 10);
  for (int i = 0; i < 30; ++i) room.look(new_view(), 20 + 0.5 * i);  // elsewhere, for a while
  room.expect_pure();
  EXPECT_LT(left_of_it(room.map), 10) << "the views that tell of it stay";
  room.world.cuboids.push_back(carton);  // it is brought back
  for (int i = 0; i < 20; ++i) room.look(object_test::view_pose(3), 40 + 0.5 * i);
  EXPECT_GT(left_of_it(room.map), 200);
  room.expect_pure();
  EXPECT_GT(left_of_it(room.map), 200);
}

/// While people walk, each new view removes a little more from all older ones.
TEST(DenseFrames, WhatGoesBitByBitIsTakenOutOnceASecondWhereSomebodyLooks) {
  const volume_test::Cuboid other{
      Vec3(0.5, 0.8, -0.8), Vec3(0.85, 1.2, -0.5), kNoSceneObject, {40, 90, 120}};
  KnownRoom room(object_test::room_config(), {other, carton});
  ASSERT_GT(left_of_it(room.map, other), 200);
  room.world.cuboids.pop_back();
  for (int i = 0; i < 3; ++i) room.look(object_test::view_pose(2 + i), 7.5 + 0.5 * i);
  EXPECT_LT(left_of_it(room.map), 10) << "at once: nothing was taken out lately";
  room.world.cuboids.pop_back();
  for (int i = 0; i < 3; ++i) room.look(object_test::view_pose(2 + i), 8.6 + 0.1 * i);
  EXPECT_GT(left_of_it(room.map, other), 200);
  for (int i = 0; i < 5; ++i) room.look(object_test::view_pose(2 + i % 3), 9.0 + 0.3 * i);
  EXPECT_LT(left_of_it(room.map, other), 10);
  room.expect_pure();
}

TEST(DenseFrames, WhatGoesIsTakenOutEveryTenSecondsWhereNobodyLooks) {
  KnownRoom room(object_test::room_config(), {carton}, false);
  room.world.cuboids.pop_back();
  for (int i = 0; i < 3; ++i) room.look(object_test::view_pose(2 + i), 7.5 + 0.5 * i);
  EXPECT_GT(left_of_it(room.map), 200);
  room.look(object_test::view_pose(3), 20);
  EXPECT_LT(left_of_it(room.map), 10);
  room.expect_pure();
}

/// Of the plan, where the carton's middle is or was.
GroundState at_carton(DenseMap& map) {
  const GroundGrid plan = live_plan(map);
  const Vec3 middle = 0.5 * (carton.low + carton.high);
  const Vec2 p = (plan.T_world_floor.inverse() * middle).head<2>();
  const Vec2 cell = ((p - plan.origin_floor) / plan.cell_m).array().floor();
  if (cell.minCoeff() < 0 || cell.x() >= plan.width || cell.y() >= plan.height)
    return GroundState::kUnknown;
  return plan.cells[static_cast<std::size_t>(cell.y() * plan.width + cell.x())];
}

DenseMapConfig low_robot() {
  DenseMapConfig config = object_test::room_config();
  config.keeps_plan = true;
  config.plan.high_m = 0.5;  // views of this room look down
  return config;
}

TEST(DenseFrames, ThePlanFreesAPlaceWithTwoViewsThatLookThrough) {
  KnownRoom room(low_robot(), {carton});
  EXPECT_EQ(at_carton(room.map), GroundState::kOccupied);
  room.world.cuboids.pop_back();
  for (int i = 0; i < 2; ++i) room.look(object_test::view_pose(2 + i), 7.5 + 0.5 * i);
  EXPECT_EQ(at_carton(room.map), GroundState::kFree) << "seven views saw it";
  EXPECT_EQ(room.map.planned(), KnownRoom::stamp_of(8));
  room.map.finish();
  EXPECT_EQ(at_carton(room.map), GroundState::kFree);
}

TEST(DenseFrames, AFrameThatShowsNothingNewTellsThePlanWhatIsFree) {
  KnownRoom room(low_robot());
  room.look(object_test::view_pose(3), 7);
  EXPECT_EQ(room.map.volume().views(), 7);
  static_cast<void>(live_plan(room.map));
  EXPECT_EQ(room.map.planned(), KnownRoom::stamp_of(7));
}

TEST(DenseFrames, ThePlanMovesWithTheMap) {
  KnownRoom room(low_robot(), {carton});
  const GroundGrid before = live_plan(room.map);
  const SE3 shift(Mat3::Identity(), Vec3(0.4, 0, -0.8));  // whole cells
  for (auto& [id, T_world_camera] : room.poses) T_world_camera = shift * T_world_camera;
  room.give({});
  const GroundGrid now = live_plan(room.map);
  ASSERT_TRUE(room.map.plan().has_floor());
  const auto occupied = [](const GroundGrid& plan) {
    return static_cast<double>(std::ranges::count(plan.cells, GroundState::kOccupied));
  };
  EXPECT_GT(occupied(before), 100);
  EXPECT_NEAR(occupied(now), occupied(before), 0.05 * occupied(before));
  EXPECT_NE(at_carton(room.map), GroundState::kUnknown);
}

TEST(DenseFrames, ThePlanIsThatOfTheFinalPosesAfterTheEnd) {
  KnownRoom room(low_robot(), {carton});
  ASSERT_GT(live_plan(room.map).width, 0);
  const SE3 shift(Mat3::Identity(), Vec3(0.4, 0, -0.8));  // whole cells
  for (auto& [id, T_world_camera] : room.poses) T_world_camera = shift * T_world_camera;
  room.map.apply({{}, {}, room.poses});
  room.map.finish();  // without a step
  DenseMap again(room.map.config(), room.camera);
  again.restore(room.map.saved());
  again.apply({{}, {}, room.poses});
  again.finish();
  const Gravity floor{-Vec3::UnitY(), -1.2, true};
  const GroundGrid now = live_plan(room.map, floor), anew = live_plan(again, floor);
  EXPECT_EQ(now.origin_floor, anew.origin_floor);
  EXPECT_EQ(now.cells, anew.cells);
}

TEST(DenseFrames, OfOnePlaceAreOnlySoManyHoweverNewEachOfThemLooks) {
  DenseMapConfig config = object_test::room_config();
  config.min_new = 0;  // all of them, as noise would have it
  config.most_near = 5;
  KnownRoom room(config);
  const int protected_frames = static_cast<int>(config.protected_s / 0.5) + 1;
  for (int i = 0; i < 40; ++i) room.look(object_test::view_pose(3), 7 + 0.5 * i);
  EXPECT_EQ(room.map.volume().views(), 7 + config.most_near + protected_frames);
  room.look(new_view(), 40);  // which is another place
  EXPECT_EQ(room.map.volume().views(), 7 + config.most_near + protected_frames + 1);
  room.expect_pure();
}

TEST(DenseFrames, GoWhenOthersShowTheSame) {
  KnownRoom room;
  room.look(new_view(), 7);
  room.look(new_view(), 7.5);
  ASSERT_EQ(room.map.volume().views(), 9);
  DenseUpdate update;
  for (std::uint32_t i = 7; i < 16; ++i) {
    const SE3 T_world_camera = i < 13 ? new_view() : object_test::view_pose(i % 7);
    room.poses[KeyframeId{i}] = T_world_camera;
    update.added.push_back(object_test::keyframe_of(room.world, room.camera, i, T_world_camera,
                                                    {{kChair, 0.8F}, {kScreen, 0.6F}},
                                                    KnownRoom::stamp_of(5.0 * i)));
  }
  room.give(std::move(update));
  EXPECT_EQ(room.map.volume().views(), 16) << "keyframes alone";
  EXPECT_EQ(room.map.saved().size(), 16U);
  room.expect_pure();
}

DenseMapConfig room_for(int views) {
  DenseMapConfig config = object_test::room_config();
  config.most_views = views;
  return config;
}

TEST(FullDenseMap, IsCorrectedWhileAKeyframeWaits) {
  KnownRoom room(room_for(7));
  room.keyframe(7, new_view(), 7);
  ASSERT_EQ(room.map.volume().views(), 7);
  const SE3 shift(Mat3::Identity(), Vec3(0.31, 0, 0.17));
  for (auto& [id, T_world_camera] : room.poses) T_world_camera = shift * T_world_camera;
  room.give({});
  for (const auto& view : room.map.views())
    EXPECT_LT((view.T_world_camera.t() - room.poses.at(view.id.keyframe).t()).norm(), 1e-9);
}

TEST(FullDenseMap, KeepsNoFramesAndNoKeyframesThatTheMapDropped) {
  KnownRoom room(room_for(7));
  for (int i = 0; i < 5; ++i) room.look(new_view(), 7 + 0.5 * i);
  EXPECT_EQ(room.map.saved().size(), 7U);
  room.keyframe(7, new_view(), 10);
  EXPECT_EQ(room.map.saved().size(), 8U) << "it may enter later";
  DenseUpdate update;
  update.removed = {{KeyframeId{7}, {kAnchor, KnownRoom::stamp_of(3), SE3()}}};
  room.poses.erase(KeyframeId{7});
  room.give(std::move(update));
  EXPECT_EQ(room.map.saved().size(), 7U);
}

TEST(FullDenseMap, FramesMakeRoomForAKeyframe) {
  DenseMapConfig config = room_for(9);
  config.most_near = 1;
  KnownRoom room(config);
  room.look(new_view(), 7);
  room.look(new_view(), 7.5);
  ASSERT_EQ(room.map.volume().views(), 9);
  const auto has = [&](std::uint32_t id) {
    return std::ranges::any_of(
        room.map.views(), [&](const auto& view) { return view.id == DenseViewId(KeyframeId{id}); });
  };
  room.keyframe(7, new_view(), 8);
  EXPECT_FALSE(has(7)) << "frames are protected for a while";
  room.keyframe(8, new_view(), 30);
  EXPECT_TRUE(has(7));
  EXPECT_EQ(room.map.volume().views(), 9);
  EXPECT_EQ(room.map.saved().size(), 10U) << "one of two frames went, a keyframe waits";
}

TEST(FullDenseMap, AKeyframeThatWaitsTellsThePlanAndWhatWent) {
  DenseMapConfig config = low_robot();
  config.most_views = 7;
  KnownRoom room(config, {carton});
  EXPECT_EQ(at_carton(room.map), GroundState::kOccupied);
  room.world.cuboids.pop_back();
  room.take_chair_away();
  for (std::uint32_t i = 7; i < 10; ++i) room.keyframe(i, object_test::view_pose(i - 5), i + 1);
  EXPECT_NE(at_carton(room.map), GroundState::kOccupied);
  EXPECT_EQ(room.map.planned(), KnownRoom::stamp_of(10));
  const StaticScene scene = named_scene(room.map);
  EXPECT_TRUE(chair_of(scene) && chair_of(scene)->state == ObjectState::kAbsent);
}

}  // namespace
}  // namespace ygslam
