// A camera found again without a guess, on a world of points.
#include "tracking/relocalizer.hpp"

#include <gtest/gtest.h>

#include "tracking/point_test_world.hpp"

namespace ygslam {
namespace {

using map_test::World;
using tracking_test::features_of;
using tracking_test::PointScene;
using tracking_test::pose_error;

/// Of frames until it is found, at most ten; 0: it is not.
int frames_until_found(Relocalizer& relocalizer, const FrameFeatures& frame, const LocalView& view,
                       Rng& rng) {
  for (int frames = 1; frames <= 10; ++frames)
    if (relocalizer.step(frame, view, rng)) return frames;
  return 0;
}

TEST(Relocalizer, FindsTheCameraWithoutAnyGuess) {
  for (std::uint64_t seed = 21; seed <= 26; ++seed) {
    PointScene scene(seed);
    Relocalizer relocalizer({}, scene.world.camera(), scene.estimator);
    Rng rng(seed);
    std::optional<PoseResult> pose;
    for (int i = 0; i < 3 && !pose; ++i) pose = relocalizer.step(scene.frame, scene.view, rng);
    ASSERT_TRUE(pose) << seed;
    EXPECT_LT(pose_error(pose->T_camera_world, World::pose(6)), 0.01);
  }
}

TEST(Relocalizer, DoesNotTakeAnotherPlaceForTheMap) {
  PointScene scene(27);
  World other(700, 1000);
  const auto elsewhere = features_of(other.see(World::pose(2), 100));
  Relocalizer relocalizer({}, scene.world.camera(), scene.estimator);
  Rng rng(6);
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(relocalizer.step(elsewhere, scene.view, rng));
}

TEST(Relocalizer, TheWholeViewIsTriedInTheCourseOfFrames) {
  PointScene scene(28);
  // Only the oldest keyframe shows the place; the newer ones are of another world.
  World other(700, 1001);
  LocalView view = scene.view;
  for (std::size_t i = 0; i + 1 < view.keyframes.size(); ++i) {
    const auto seen = other.see(World::pose(3), 7);
    view.keyframes[i].data = std::make_shared<KeyframeData>(
        KeyframeData{view.keyframes[i].data->id, seen.frame->id, {}, seen.features, seen.grid});
    view.keyframes[i].landmarks.assign(seen.features->size(), 0);
  }
  Relocalizer relocalizer({}, scene.world.camera(), scene.estimator);
  Rng rng(7);
  std::optional<PoseResult> pose;
  int frames = 0;
  for (; frames < 5 && !pose; ++frames) pose = relocalizer.step(scene.frame, view, rng);
  EXPECT_TRUE(pose);
  EXPECT_GT(frames, 1) << "a few keyframes per frame, not all at once";
}

TEST(Relocalizer, AnotherReferenceIsTriedFirst) {
  PointScene scene(28);
  World other(700, 1002);
  LocalView view = scene.view;
  const ViewKeyframe right = view.keyframes.back();
  for (ViewKeyframe& keyframe : view.keyframes) {
    const auto seen = other.see(World::pose(3), 7);
    keyframe.data = std::make_shared<KeyframeData>(
        KeyframeData{keyframe.data->id, seen.frame->id, {}, seen.features, seen.grid});
    keyframe.landmarks.assign(seen.features->size(), 0);
  }
  Relocalizer relocalizer({.keyframes_per_frame = 1}, scene.world.camera(), scene.estimator);
  Rng rng(8);
  ASSERT_FALSE(relocalizer.step(scene.frame, view, rng));
  view.keyframes.insert(view.keyframes.begin(), right);
  EXPECT_TRUE(relocalizer.step(scene.frame, view, rng)) << "not where the last view had come to";
}

TEST(Relocalizer, PointsWithoutWeightAndFeaturesWithoutALandmarkHaveNoSay) {
  PointScene scene(29);
  Relocalizer relocalizer({}, scene.world.camera(), scene.estimator);
  Rng rng(9);
  FrameFeatures moving = scene.frame;
  moving.static_weight.assign(moving.features->size(), 0.0F);
  EXPECT_EQ(frames_until_found(relocalizer, moving, scene.view, rng), 0);
  LocalView unmapped = scene.view;
  for (ViewKeyframe& keyframe : unmapped.keyframes)
    keyframe.landmarks.assign(keyframe.landmarks.size(), -1);
  EXPECT_EQ(frames_until_found(relocalizer, scene.frame, unmapped, rng), 0);
  EXPECT_GT(frames_until_found(relocalizer, scene.frame, scene.view, rng), 0);
}

TEST(Relocalizer, FewPointsAreNotEnoughHoweverWellTheyAgree) {
  PointScene scene(30);
  Rng rng(10);
  std::size_t left = 30;  // enough to try a pose
  for (float& weight : scene.frame.static_weight) {
    weight = left > 0 ? 1.0F : 0.0F;
    if (left > 0) --left;
  }
  Relocalizer strict({}, scene.world.camera(), scene.estimator);
  EXPECT_EQ(frames_until_found(strict, scene.frame, scene.view, rng), 0);
  Relocalizer lenient({.min_matches = 12, .min_inliers = 15}, scene.world.camera(),
                      scene.estimator);
  EXPECT_GT(frames_until_found(lenient, scene.frame, scene.view, rng), 0);
}

}  // namespace
}  // namespace ygslam
