// Pose by matching against the last frame and the map, relocalisation, and the first frame, on a
// world of points.
#include "tracking/pose_estimator.hpp"

#include <gtest/gtest.h>

#include "map/map_test_world.hpp"
#include "tracking/relocalizer.hpp"

namespace ygslam {
namespace {

using map_test::kLevels;
using map_test::kScale;
using map_test::World;

TrackedFrame tracked(const map_test::SeenFrame& seen) {
  TrackedFrame frame;
  frame.frame = seen.frame;
  frame.features = seen.features;
  frame.grid = seen.grid;
  frame.static_weight.assign(seen.features->size(), 1.0F);
  frame.landmarks.assign(seen.features->size(), kNoLandmark);
  return frame;
}

LocalView view_of(const Map& map) {
  LocalView view;
  for (auto it = map.keyframes().rbegin(); it != map.keyframes().rend(); ++it) {
    ViewKeyframe keyframe{it->second.data, it->second.T_camera_world, {}, 0};
    for (const LandmarkId id : it->second.landmarks) {
      if (id == kNoLandmark) {
        keyframe.landmarks.push_back(-1);
        continue;
      }
      const auto [entry, is_new] =
          view.landmark_index.emplace(id, static_cast<std::uint32_t>(view.landmarks.size()));
      if (is_new) {
        const Landmark& l = map.landmark(id);
        view.landmarks.push_back(
            {id, l.p_world, l.normal_world, l.descriptor, l.min_distance_m, l.max_distance_m});
      }
      keyframe.landmarks.push_back(static_cast<std::int32_t>(entry->second));
    }
    view.keyframes.push_back(std::move(keyframe));
  }
  return view;
}

double pose_error(const SE3& T_estimate, const SE3& T_truth) {
  return (T_estimate * T_truth.inverse()).log().norm();
}

SE3 perturbed(const SE3& T, double translation_m, double rotation_rad, Rng& rng) {
  Vec6 twist;
  for (int i = 0; i < 6; ++i) twist[i] = rng.normal(0, i < 3 ? translation_m : rotation_rad);
  return SE3::exp(twist) * T;
}

/// A wall on which one point in fifteen has a double 0.2 m aside.
World with_doubles(std::uint64_t seed) {
  World world(1500, seed);
  auto& points = world.points();
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].p_world.z() = 2.5;
    points[i].size_m = 0.007;
    if (i % 15 != 1) continue;
    points[i] = points[i - 1];
    points[i].p_world.x() += 0.2;
  }
  return world;
}

struct Scene {
  explicit Scene(std::uint64_t seed, int points = 700,
                 const map_test::Sight& sight = {.noise_px = 0.5})
      : Scene(World(points, seed), sight) {}
  Scene(World seen_world, const map_test::Sight& sight)
      : world(std::move(seen_world)),
        truth(map_test::true_map(world, 6, sight)),
        view(view_of(truth.map)),
        last(tracked(truth.seen.back())),
        now(world.see(World::pose(6), 100, sight)),
        frame(tracked(now)),
        estimator({}, world.camera(), {kLevels, kScale}) {
    last.landmarks = truth.map.keyframe(KeyframeId{5}).landmarks;
  }
  [[nodiscard]] std::optional<PoseResult> track(const SE3& T_guess, Rng& rng) const {
    return track(frame, view, T_guess, rng);
  }
  [[nodiscard]] std::optional<PoseResult> track(const TrackedFrame& current, const LocalView& map,
                                                const SE3& T_guess, Rng& rng) const {
    const auto first =
        estimator.match_previous_frame(current, last, World::pose(5), map, T_guess, rng);
    return first ? estimator.match_map(current, map, *first) : std::nullopt;
  }

  World world;
  map_test::TrueMap truth;
  LocalView view;
  TrackedFrame last;
  map_test::SeenFrame now;
  TrackedFrame frame;
  PoseEstimator estimator;
};

TEST(PoseEstimator, FindsThePoseFromAPerturbedGuess) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Scene scene(seed);
    Rng rng(seed);
    const auto pose = scene.track(perturbed(World::pose(6), 0.03, 0.01, rng), rng);
    ASSERT_TRUE(pose) << seed;
    EXPECT_LT(pose_error(pose->T_camera_world, World::pose(6)), 0.006) << seed;
    EXPECT_GT(pose->landmark_inliers, 200);
    // What it calls a match is one.
    for (std::uint32_t i = 0; i < pose->landmarks.size(); ++i) {
      if (pose->landmarks[i] == kNoLandmark) continue;
      ASSERT_EQ(pose->landmarks[i], scene.truth.landmark[scene.now.point[i]]);
    }
  }
}

TEST(PoseEstimator, AGuessFarOffIsSavedByDescriptors) {
  Scene scene(11);
  Rng rng(1);
  Vec6 turn = Vec6::Zero();
  turn[4] = 0.35;  // 180 px
  const auto pose = scene.track(SE3::exp(turn) * World::pose(6), rng);
  ASSERT_TRUE(pose);
  EXPECT_LT(pose_error(pose->T_camera_world, World::pose(6)), 0.01);
}

TEST(PoseEstimator, DoublesInTheWindowDoNotEndTheSearch) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Scene scene(with_doubles(seed), {.noise_px = 0.2});
    Rng rng(seed);
    Vec6 turn = Vec6::Zero();
    turn[4] = -0.08;  // 42 px: where a point was expected its double is
    const auto pose = scene.track(SE3::exp(turn) * World::pose(6), rng);
    ASSERT_TRUE(pose) << seed;
    EXPECT_LT(pose_error(pose->T_camera_world, World::pose(6)), 0.006) << seed;
  }
}

TEST(PoseEstimator, PointsWithoutWeightHaveNoSay) {
  Scene scene(12);
  // Four in ten features moved aside, all by the same 12 px: a mover's.
  auto moved = std::make_shared<Features>(*scene.now.features);
  for (std::size_t i = 0; i < moved->size(); ++i) {
    if (i % 10 >= 4) continue;
    moved->points[i].ideal_px.x() += 12;
    moved->points[i].uv_px.x() += 12;
    scene.frame.static_weight[i] = 0.0F;
  }
  scene.frame.features = moved;
  scene.frame.grid = FeatureGrid(*moved, scene.world.camera().ideal_bounds());
  Rng rng(2);
  const auto pose = scene.track(World::pose(6), rng);
  ASSERT_TRUE(pose);
  EXPECT_LT(pose_error(pose->T_camera_world, World::pose(6)), 0.006);
  for (std::size_t i = 0; i < moved->size(); ++i) {
    if (i % 10 < 4) {
      EXPECT_EQ(pose->landmarks[i], kNoLandmark);
    }
  }
}

TEST(PoseEstimator, PointsThatMovedUnnoticedDisagree) {
  Scene scene(13);
  auto moved = std::make_shared<Features>(*scene.now.features);
  for (std::size_t i = 0; i < moved->size(); i += 5) {
    moved->points[i].ideal_px.y() += 10;
    moved->points[i].uv_px.y() += 10;
  }
  scene.frame.features = moved;
  scene.frame.grid = FeatureGrid(*moved, scene.world.camera().ideal_bounds());
  Rng rng(3);
  const auto pose = scene.track(World::pose(6), rng);
  ASSERT_TRUE(pose);
  EXPECT_LT(pose_error(pose->T_camera_world, World::pose(6)), 0.006);
  int agreeing = 0;
  for (std::size_t i = 0; i < moved->size(); i += 5)
    agreeing += pose->landmarks[i] != kNoLandmark ? 1 : 0;
  EXPECT_LT(agreeing, 0.05 * static_cast<double>(moved->size()) / 5);
}

TEST(PoseEstimator, WorksFromTheLastFramesDepthBeforeThereIsAMap) {
  Scene scene(14);
  scene.last.landmarks.assign(scene.last.landmarks.size(), kNoLandmark);
  Rng rng(4);
  const auto pose = scene.track(scene.frame, LocalView{}, World::pose(5), rng);
  ASSERT_TRUE(pose);
  EXPECT_LT(pose_error(pose->T_camera_world, World::pose(6)), 0.01);
  EXPECT_EQ(pose->landmark_inliers, 0);
}

TEST(PoseEstimator, AnotherWorldGivesNoPose) {
  Scene scene(15);
  World other(700, 999);
  const auto elsewhere = other.see(World::pose(6), 100);
  Rng rng(5);
  const auto pose = scene.track(tracked(elsewhere), scene.view, World::pose(6), rng);
  EXPECT_TRUE(!pose || pose->landmark_inliers < 15);
}

/// A frame posed a little aside of what its landmarks say alone, in a world then corrected.
struct Corrected : Scene {
  explicit Corrected(std::uint64_t seed) : Scene(seed), rng(seed) {
    last.view = std::make_shared<const LocalView>(view);
    last.T_camera_world = perturbed(World::pose(5), 0.002, 0.001, rng);
  }
  Rng rng;
};

TEST(PoseEstimator, AFrameGoesWithItsLandmarks) {
  for (std::uint64_t seed = 31; seed <= 35; ++seed) {
    Corrected scene(seed);
    const SE3 T_new_old = perturbed(SE3(), 0.3, 0.1, scene.rng);
    for (std::size_t i = 0; i < scene.view.landmarks.size(); ++i) {
      ViewLandmark& landmark = scene.view.landmarks[i];
      landmark.p_world = T_new_old * landmark.p_world;
      if (i % 3 == 0) scene.view.landmark_index.erase(landmark.id);  // gone in the meantime
    }
    const SE3 T_camera_new = scene.last.T_camera_world * T_new_old.inverse();
    // Its reference keyframe was moved a little differently.
    const SE3 T_guess_new = perturbed(T_camera_new, 0.005, 0.002, scene.rng);
    const auto followed = scene.estimator.follow_landmarks(scene.last, scene.view, T_guess_new);
    ASSERT_TRUE(followed) << seed;
    EXPECT_LT(pose_error(*followed, T_camera_new), 1e-4) << seed;
    EXPECT_GT(pose_error(T_guess_new, T_camera_new), 1e-3) << seed;
  }
}

TEST(PoseEstimator, WhereLandmarksWentApartAFrameGoesBetweenThem) {
  Corrected scene(36);
  for (std::size_t i = 0; i < scene.view.landmarks.size(); ++i)
    scene.view.landmarks[i].p_world.x() += i % 2 == 0 ? 0.004 : 0.0;
  Vec6 aside = Vec6::Zero();
  aside[0] = -0.004;  // with the one half
  const auto followed = scene.estimator.follow_landmarks(
      scene.last, scene.view, SE3::exp(aside) * scene.last.T_camera_world);
  ASSERT_TRUE(followed);
  const double moved_m = (followed->inverse().t() - scene.last.T_camera_world.inverse().t()).norm();
  EXPECT_GT(moved_m, 0.001);
  EXPECT_LT(moved_m, 0.003);
}

TEST(PoseEstimator, WithoutItsLandmarksAFrameFollowsNothing) {
  Corrected scene(37);
  EXPECT_FALSE(
      scene.estimator.follow_landmarks(scene.last, LocalView{}, scene.last.T_camera_world));
  scene.last.landmarks.assign(scene.last.landmarks.size(), kNoLandmark);
  EXPECT_FALSE(scene.estimator.follow_landmarks(scene.last, scene.view, scene.last.T_camera_world));
}

TEST(Relocalizer, FindsTheCameraWithoutAnyGuess) {
  for (std::uint64_t seed = 21; seed <= 26; ++seed) {
    Scene scene(seed);
    Relocalizer relocalizer({}, scene.world.camera(), scene.estimator);
    Rng rng(seed);
    std::optional<PoseResult> pose;
    for (int i = 0; i < 3 && !pose; ++i) pose = relocalizer.step(scene.frame, scene.view, rng);
    ASSERT_TRUE(pose) << seed;
    EXPECT_LT(pose_error(pose->T_camera_world, World::pose(6)), 0.01);
  }
}

TEST(Relocalizer, DoesNotTakeAnotherPlaceForTheMap) {
  Scene scene(27);
  World other(700, 1000);
  const auto elsewhere = tracked(other.see(World::pose(2), 100));
  Relocalizer relocalizer({}, scene.world.camera(), scene.estimator);
  Rng rng(6);
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(relocalizer.step(elsewhere, scene.view, rng));
}

TEST(Relocalizer, TheWholeViewIsTriedInTheCourseOfFrames) {
  Scene scene(28);
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

}  // namespace
}  // namespace ygslam
