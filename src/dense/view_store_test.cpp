#include "dense/view_store.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "geometry/properties_testing.hpp"

#include "core/rng.hpp"
#include "dense/pose_distance.hpp"

namespace ygslam {
namespace {

std::shared_ptr<const StoredView> some_images(std::uint16_t depth = 1000) {
  DepthView view;
  view.camera = {100, 100, 3.5, 2.5, 8, 6};
  view.depth = Image<std::uint16_t>(8, 6, depth);
  view.colour = ColourImage(8, 6);
  view.object = Image<std::uint8_t>(8, 6);
  return std::make_shared<const StoredView>(view);
}

SE3 random_pose(Rng& rng) {
  Vec6 twist;
  for (int i = 0; i < 6; ++i) twist[i] = rng.normal();
  return SE3::exp(twist);
}

DenseView keyframe(double t_s = 0) {
  return {some_images(), {}, Timestamp{static_cast<std::int64_t>(1e9 * t_s)}};
}

/// Tied to a keyframe, T_camera_keyframe away from it.
DenseView frame(KeyframeId anchor, const SE3& T_camera_keyframe, double t_s = 0) {
  DenseView view = keyframe(t_s);
  view.anchor = DenseAnchor{anchor, {}, T_camera_keyframe};
  return view;
}

void expect_near(const SE3& a, const SE3& b) { EXPECT_LT(distance_m(a, b), 1e-9); }

TEST(ViewStore, NumbersFramesBehindTheirKeyframeInTheOrderInWhichTheyCome) {
  ViewStore store;
  const KeyframeId first{4}, second{7};
  EXPECT_EQ(store.add(first, keyframe()), DenseViewId(first));
  EXPECT_EQ(store.add(first, frame(first, SE3())), DenseViewId(first, 1));
  EXPECT_EQ(store.add(second, keyframe()), DenseViewId(second));
  EXPECT_EQ(store.add(first, frame(second, SE3())), DenseViewId(first, 2))
      << "by the newest keyframe when it was taken, whichever it is tied to";
  EXPECT_EQ(store.add(second, frame(second, SE3())), DenseViewId(second, 1));
  EXPECT_EQ(store.add(KeyframeId{2}, frame(second, SE3())), DenseViewId(KeyframeId{2}, 1))
      << "the keyframe itself may be gone";
  std::vector<DenseViewId> order;
  for (const auto& [id, view] : store.all()) order.push_back(id);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
  EXPECT_EQ(order.size(), 6U);
  store.remove({first, 1});
  EXPECT_FALSE(store.contains({first, 1}));
  EXPECT_EQ(store.add(first, frame(first, SE3())), DenseViewId(first, 3))
      << "a number is not given twice while a later one is there";
}

TEST(ViewStore, AViewWithoutAPoseOfItsKeyframeHasNoPlace) {
  ViewStore store;
  Rng rng(3);
  const SE3 T_camera_keyframe = random_pose(rng), T_world_keyframe = random_pose(rng);
  store.add(KeyframeId{1}, keyframe());
  store.add(KeyframeId{1}, frame(KeyframeId{1}, T_camera_keyframe));
  EXPECT_FALSE(store.set_poses({{KeyframeId{2}, SE3()}})) << "none before, none now";
  EXPECT_FALSE(store.at(KeyframeId{1}).T_world_camera);
  EXPECT_TRUE(store.set_poses({{KeyframeId{1}, T_world_keyframe}}));
  expect_near(*store.at(KeyframeId{1}).T_world_camera, T_world_keyframe);
  expect_near(*store.at({KeyframeId{1}, 1}).T_world_camera,
              T_world_keyframe * T_camera_keyframe.inverse());
  EXPECT_FALSE(store.set_poses({{KeyframeId{1}, T_world_keyframe}})) << "to the bit the same";
  EXPECT_TRUE(store.set_poses({}));
  EXPECT_FALSE(store.at({KeyframeId{1}, 1}).T_world_camera);
}

TEST(ViewStore, ADroppedKeyframeAndItsFramesStayWhereTheyWere) {
  ViewStore store;
  Rng rng(5);
  const KeyframeId old{1}, heir{2};
  std::map<KeyframeId, SE3> poses{{old, random_pose(rng)}, {heir, random_pose(rng)}};
  store.add(old, keyframe(1));
  store.add(old, frame(old, random_pose(rng)));
  store.add(heir, keyframe(2));
  store.set_poses(poses);
  const SE3 of_keyframe = *store.at(old).T_world_camera;
  const SE3 of_frame = *store.at({old, 1}).T_world_camera;
  store.reanchor({old, {heir, {}, poses.at(old).inverse() * poses.at(heir)}});
  poses.erase(old);
  store.set_poses(poses);
  ASSERT_TRUE(store.at(old).anchor) << "a keyframe no more";
  EXPECT_EQ(store.at(old).anchor->keyframe, heir);
  expect_near(*store.at(old).T_world_camera, of_keyframe);
  expect_near(*store.at({old, 1}).T_world_camera, of_frame);
  const SE3 correction = random_pose(rng);
  poses.at(heir) = correction * poses.at(heir);
  store.set_poses(poses);
  expect_near(*store.at(old).T_world_camera, correction * of_keyframe);
  expect_near(*store.at({old, 1}).T_world_camera, correction * of_frame);
}

/// However many keyframes are dropped one after the other: what is left moves as one with the
/// world.
RC_GTEST_PROP(ViewStoreProperty, ViewsFollowACorrectionThroughAnyChainOfAnchors, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const auto count = *rc::gen::inRange<std::uint32_t>(2, 8);
  ViewStore store;
  std::map<KeyframeId, SE3> poses;
  for (std::uint32_t i = 0; i < count; ++i) {
    poses[KeyframeId{i}] = random_pose(rng);
    store.add(KeyframeId{i}, keyframe(i));
    for (std::uint64_t k = rng.below(3); k > 0; --k) {
      const SE3 pose = random_pose(rng);
      store.add(KeyframeId{i}, frame(KeyframeId{rng.below(i + 1)}, pose));
    }
  }
  store.set_poses(poses);
  std::map<DenseViewId, SE3> before;
  for (const auto& [id, view] : store.all()) before[id] = *view.T_world_camera;
  while (poses.size() > 1) {
    auto dropped = poses.begin();
    std::advance(dropped, static_cast<std::ptrdiff_t>(rng.below(poses.size())));
    const auto [old, T_world_old] = *dropped;
    poses.erase(dropped);
    auto heir = poses.begin();
    std::advance(heir, static_cast<std::ptrdiff_t>(rng.below(poses.size())));
    store.reanchor({old, {heir->first, {}, T_world_old.inverse() * heir->second}});
  }
  const SE3 correction = random_pose(rng);
  for (auto& [id, T_world_camera] : poses) T_world_camera = correction * T_world_camera;
  store.set_poses(poses);
  for (const auto& [id, view] : store.all()) {
    RC_ASSERT(view.T_world_camera.has_value());
    RC_ASSERT(distance_m(*view.T_world_camera, correction * before.at(id)) < 1e-6);
  }
}

TEST(ViewStore, SavesWhatHasAPlaceAndTakesItOverAsItWas) {
  ViewStore store;
  store.add(KeyframeId{1}, keyframe(1));
  DenseView tied = frame(KeyframeId{1}, SE3(Mat3::Identity(), Vec3(0, 0, 0.5)), 1.5);
  tied.observations = {{{coco_class(56), 0.5F}, {Eigen::Vector3f(1, 2, 3)}}};
  store.add(KeyframeId{1}, tied);
  store.add(KeyframeId{2}, keyframe(2));  // has no place
  store.set_poses({{KeyframeId{1}, SE3()}});
  const std::vector<SavedView> saved = store.saved();
  ASSERT_EQ(saved.size(), 2U);
  ViewStore again;
  for (const SavedView& view : saved) again.restore(view);
  EXPECT_FALSE(again.at(KeyframeId{1}).T_world_camera) << "poses are the map's";
  again.set_poses({{KeyframeId{1}, SE3()}});
  ASSERT_EQ(again.all().size(), 2U);
  for (const auto& [id, view] : again.all()) {
    const DenseView& its = store.at(id);
    EXPECT_EQ(view.images, its.images);
    EXPECT_EQ(view.stamp, its.stamp);
    EXPECT_EQ(view.observations.size(), its.observations.size());
    EXPECT_EQ(view.anchor.has_value(), its.anchor.has_value());
    EXPECT_TRUE(same(view.T_world_camera, its.T_world_camera));
  }
  EXPECT_GT(store.memory_bytes(), again.memory_bytes());
}

TEST(ViewUnpacker, KeepsTheLastViewUntilAnotherIsAskedFor) {
  ViewUnpacker unpacker;
  const auto near = some_images(1000), far = some_images(5000);
  const DepthView* first = &unpacker.unpacked(near);
  EXPECT_EQ(first->depth.at(0, 0), 1000);
  EXPECT_EQ(unpacker.unpacked(far).depth.at(7, 5), 5000);
  EXPECT_EQ(unpacker.unpacked(near).depth.at(7, 5), 1000);
  DepthView marked = near->restored();
  marked.depth.at(0, 0) = 77;
  unpacker.keep(near, marked);
  EXPECT_EQ(unpacker.unpacked(near).depth.at(0, 0), 77) << "what was kept is not unpacked";
}

}  // namespace
}  // namespace ygslam
