// Fusing, adjusting, culling, masking and the view: each on a map whose truth is known.
#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "geometry/random_vector.hpp"
#include "map/map_test_world.hpp"
#include "mapping/bundle_window.hpp"
#include "mapping/mapper.hpp"
#include "mapping/neighbour_fusion.hpp"
#include "mapping/view_builder.hpp"

namespace ygslam {
namespace {

using map_test::kLevels;
using map_test::kScale;
using map_test::World;

Mapper make_mapper(const World& world, const MapperConfig& config = {}) {
  return Mapper(config, world.camera(), Map({kLevels, kScale}));
}

KeyframeCandidate candidate_of(const map_test::SeenFrame& seen, KeyframeId reference,
                               const SE3& T_reference_world) {
  return {seen.frame,
          seen.features,
          ReadOut{},
          std::vector<LandmarkId>(seen.features->size(), kNoLandmark),
          std::vector<float>(seen.features->size(), 1.0F),
          {reference, seen.T_camera_world * T_reference_world.inverse()},
          {},
          0};
}

TEST(NeighbourFusion, TwoLandmarksOfOnePointBecomeOne) {
  World world(400, 1);
  Map map({kLevels, kScale});
  std::vector<map_test::SeenFrame> seen;
  // Every keyframe makes its own landmarks; none knows of the others'.
  for (int i = 0; i < 4; ++i) {
    seen.push_back(world.see(World::pose(i), static_cast<std::uint32_t>(i)));
    const KeyframeId id = map_test::add_keyframe(
        map, seen.back(), i ? KeyframeId{static_cast<std::uint32_t>(i - 1)} : kNoKeyframe);
    for (std::uint32_t k = 0; k < seen.back().point.size(); ++k)
      map.add_landmark(world.points()[seen.back().point[k]].p_world, id, k);
  }
  const std::size_t before = map.landmark_count();
  EXPECT_GT(fuse_with_neighbours(map, world.camera(), KeyframeId{3}, {}), 0);
  EXPECT_LT(map.landmark_count(), 0.5 * static_cast<double>(before));
  // No landmark mixes points, and nearly every point of the newest keyframe is one landmark.
  int mixed = 0, whole = 0;
  for (const LandmarkId id : map.keyframe(KeyframeId{3}).landmarks) {
    ASSERT_NE(id, kNoLandmark);
    std::set<int> points;
    for (const auto& o : map.landmark(id).observations)
      points.insert(seen[index(o.keyframe)].point[o.feature]);
    mixed += points.size() > 1 ? 1 : 0;
    whole += map.landmark(id).observations.size() >= 3 ? 1 : 0;
  }
  EXPECT_EQ(mixed, 0);
  EXPECT_GT(whole, 0.9 * static_cast<double>(seen[3].point.size()));
}

TEST(NeighbourFusion, AnotherDepthIsAnotherPoint) {
  World world(300, 2);
  auto truth = map_test::true_map(world, 2);
  // The same descriptors, but everything that keyframe 1 measured is farther by a third.
  Map map({kLevels, kScale});
  map_test::add_keyframe(map, truth.seen[0], kNoKeyframe);
  auto moved = truth.seen[1];
  auto features = std::make_shared<Features>(*moved.features);
  for (auto& f : features->points) f.depth_m *= 1.33F;
  moved.features = features;
  map_test::add_keyframe(map, moved, KeyframeId{0});
  for (std::uint32_t k = 0; k < truth.seen[0].point.size(); ++k)
    map.add_landmark(world.points()[truth.seen[0].point[k]].p_world, KeyframeId{0}, k);
  EXPECT_EQ(fuse_with_neighbours(map, world.camera(), KeyframeId{1}, {}), 0);
}

TEST(BundleWindow, AdjustmentBringsAPerturbedMapBack) {
  World world(500, 3);
  auto truth = map_test::true_map(world, 6, {.noise_px = 0.3});
  Map& map = truth.map;
  Rng rng(4);
  const auto noise = [&](double sigma) { return random_normals<3>(rng, sigma); };
  for (std::uint32_t i = 1; i < 6; ++i) {
    Vec6 twist;
    twist << noise(0.02), noise(0.01);
    map.set_pose(KeyframeId{i}, SE3::exp(twist) * World::pose(static_cast<int>(i)));
  }
  for (const LandmarkId id : truth.landmark)
    if (id != kNoLandmark) map.set_position(id, map.landmark(id).p_world + noise(0.03));
  const auto pose_error = [&] {
    double sum = 0;
    for (std::uint32_t i = 0; i < 6; ++i)
      sum +=
          (map.keyframe(KeyframeId{i}).T_camera_world * World::pose(static_cast<int>(i)).inverse())
              .log()
              .norm();
    return sum / 6;
  };
  const double before = pose_error();
  const BundleWindow window = make_bundle_window(map, KeyframeId{5}, {}, {});
  const BundleResult result = adjust_bundle(world.camera(), window.problem, {});
  ASSERT_TRUE(result.usable);
  apply_bundle(map, window, result);
  EXPECT_LT(pose_error(), 0.1 * before);
  EXPECT_LT((map.keyframe(KeyframeId{0}).T_camera_world * World::pose(0).inverse()).log().norm(),
            1e-12)
      << "the first keyframe holds the world";
}

TEST(BundleWindow, HoldsFreeKeyframesFixedOnesAndAllTheirObservations) {
  World world(400, 5);
  const auto truth = map_test::true_map(world, 10);
  BundleWindowConfig config;
  config.free_keyframes = 3;
  config.fixed_keyframes = 4;
  const BundleWindow window = make_bundle_window(truth.map, KeyframeId{9}, {}, config);
  ASSERT_EQ(window.keyframes.size(), 7U);
  int fixed = 0;
  for (const BundlePose& pose : window.problem.poses) fixed += pose.fixed ? 1 : 0;
  EXPECT_EQ(fixed, 4);
  const std::set<KeyframeId> unique(window.keyframes.begin(), window.keyframes.end());
  EXPECT_EQ(unique.size(), 7U);
  std::size_t observations = 0;
  for (const LandmarkId id : window.landmarks)
    for (const auto& o : truth.map.landmark(id).observations)
      observations += unique.contains(o.keyframe);
  EXPECT_EQ(window.problem.observations.size(), observations);
}

// Led by an IMU along a bare wall, a keyframe shares a few wrong matches with older ones, which
// agree on a place 0.2 m aside.
TEST(BundleWindow, AMotionHoldsAKeyframeAgainstAFewWrongMatches) {
  const auto pulled_m = [](bool has_motion) {
    World world(400, 9);
    auto truth = map_test::true_map(world, 4, {.noise_px = 0.3});
    Map& map = truth.map;
    const SE3 aside(Mat3::Identity(), {0.2, 0, 0});
    const SE3 T_true_world = SE3(Mat3::Identity(), {0.05, 0, 0.1}) * World::pose(3);
    map_test::SeenFrame seen = world.see(aside * T_true_world, 100);
    seen.T_camera_world = T_true_world;
    const KeyframeId id = map_test::add_keyframe(map, seen, KeyframeId{3});
    int matches = 0;
    for (std::uint32_t k = 0; k < seen.point.size() && matches < 12; ++k) {
      const LandmarkId landmark = truth.landmark[seen.point[k]];
      if (landmark != kNoLandmark && map.add_observation(landmark, id, k)) ++matches;
    }
    const SE3 T_world_first = map.keyframe(KeyframeId{0}).T_camera_world.inverse();
    if (has_motion)
      map.set_motion(id, {KeyframeId{0}, T_true_world * T_world_first, 1e-4 * Mat6::Identity()});
    BundleWindowConfig few;
    few.free_keyframes = 2;
    few.fixed_keyframes = 1;  // where the motion began is not among them
    const BundleWindow window = make_bundle_window(map, id, {}, few);
    EXPECT_EQ(window.problem.motions.size(), has_motion ? 1U : 0U);
    apply_bundle(map, window, adjust_bundle(world.camera(), window.problem, {}));
    return (map.keyframe(id).T_camera_world * T_true_world.inverse()).t().norm();
  };
  EXPECT_GT(pulled_m(false), 0.15);
  EXPECT_LT(pulled_m(true), 0.02);
}

TEST(BundleWindow, AMotionBetweenFixedKeyframesHasNoSay) {
  World world(400, 10);
  auto truth = map_test::true_map(world, 6);
  const SE3 wrong(Mat3::Identity(), {1, 0, 0});
  truth.map.set_motion(KeyframeId{1}, {KeyframeId{0}, wrong, Mat6::Identity()});
  BundleWindowConfig config;
  config.free_keyframes = 2;  // 4 and 5
  EXPECT_TRUE(make_bundle_window(truth.map, KeyframeId{5}, {}, config).problem.motions.empty());
  config.fixed_keyframes = 2;
  const auto few = make_bundle_window(truth.map, KeyframeId{5}, {}, config);
  EXPECT_EQ(few.keyframes.size(), 4U) << "nor does where it began come along";
  EXPECT_EQ(make_whole_window(truth.map, {}).problem.motions.size(), 1U);
}

TEST(BundleWindow, GravityTellsFreeKeyframesHowTheyLean) {
  constexpr double kLean_rad = 0.02;
  World world(400, 11);
  auto truth = map_test::true_map(world, 8);
  Map& map = truth.map;
  for (std::uint32_t i = 0; i < 8; ++i) {
    auto data = std::make_shared<KeyframeData>(*map.keyframe(KeyframeId{i}).data);
    data->gravity = {World::pose(static_cast<int>(i)).R() * Vec3::UnitY(), Mat3::Zero()};
    map.set_data(KeyframeId{i}, data);
  }
  const SE3 lean(so3_exp({kLean_rad, 0, 0}), Vec3::Zero());
  map.set_pose(KeyframeId{7}, World::pose(7) * lean);
  BundleWindowConfig config;
  config.free_keyframes = 1;
  const BundleWindow window = make_bundle_window(map, KeyframeId{7}, {}, config);
  ASSERT_EQ(window.problem.directions.size(), 1U) << "fixed keyframes stay as they are";
  const MeasuredDirection& gravity = window.problem.directions.front();
  EXPECT_EQ(window.keyframes[gravity.pose], KeyframeId{7});
  const SE3 T_upright_local = World::pose(7) * window.T_local_world.inverse();
  EXPECT_LT(direction_residual(gravity, T_upright_local).norm(), 0.2 * kLean_rad);
  const SE3& T_leaning_local = window.problem.poses[gravity.pose].T_camera_world;
  EXPECT_GT(direction_residual(gravity, T_leaning_local).norm(), 0.8 * kLean_rad);
  EXPECT_EQ(make_whole_window(map, {}).problem.directions.size(), 7U) << "all but the root";
}

TEST(BundleWindow, AWrongMatchLosesItsObservationAndNotTheMap) {
  World world(400, 6);
  auto truth = map_test::true_map(world, 5, {.noise_px = 0.3});
  // One feature of the newest keyframe shows another point than its landmark.
  const Keyframe& newest = truth.map.keyframe(KeyframeId{4});
  std::uint32_t a = 0;
  while (truth.map.landmark(newest.landmarks[a]).observations.size() < 5) ++a;
  const LandmarkId wrong = newest.landmarks[a];
  std::uint32_t b = a + 1;
  while ((newest.data->features->points[b].ideal_px - newest.data->features->points[a].ideal_px)
             .norm() < 60)
    ++b;
  truth.map.remove_observation(newest.landmarks[b], KeyframeId{4});
  truth.map.remove_observation(wrong, KeyframeId{4});
  ASSERT_TRUE(truth.map.add_observation(wrong, KeyframeId{4}, b));
  const BundleWindow window = make_bundle_window(truth.map, KeyframeId{4}, {}, {});
  apply_bundle(truth.map, window, adjust_bundle(world.camera(), window.problem, {}));
  EXPECT_EQ(truth.map.keyframe(KeyframeId{4}).landmarks[b], kNoLandmark);
  EXPECT_EQ(truth.map.landmark(wrong).observations.size(), 4U);
}

TEST(BundleWindow, F32PointsThatAreNoNumbersLeaveThePosesFinite) {
  World world(400, 7);
  auto truth = map_test::true_map(world, 4);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  int spoiled = 0;
  for (const LandmarkId id : truth.landmark)
    if (id != kNoLandmark && ++spoiled % 7 == 0) truth.map.set_position(id, {nan, 0, 1e300});
  const BundleWindow window = make_bundle_window(truth.map, KeyframeId{3}, {}, {});
  apply_bundle(truth.map, window, adjust_bundle(world.camera(), window.problem, {}));
  for (std::uint32_t i = 0; i < 4; ++i) {
    const SE3& T = truth.map.keyframe(KeyframeId{i}).T_camera_world;
    ASSERT_TRUE(T.is_finite());
    EXPECT_LT((T * World::pose(static_cast<int>(i)).inverse()).log().norm(), 0.01);
  }
}

TEST(Mapper, BuildsAConsistentMapOfAWalk) {
  World world(600, 11);
  Mapper mapper = make_mapper(world);
  for (int i = 0; i < 8; ++i) {
    const auto seen =
        world.see(World::pose(i), static_cast<std::uint32_t>(10 * i), {.noise_px = 0.3});
    mapper.insert(i ? candidate_of(seen, KeyframeId{0}, World::pose(0))
                    : candidate_of(seen, kNoKeyframe, SE3()));
    mapper.refine();
  }
  const Map& map = mapper.map();
  // One landmark per point, not one per sighting.
  EXPECT_LT(map.landmark_count(), 650U);
  EXPECT_GT(map.landmark_count(), 250U);
  for (const auto& [id, keyframe] : map.keyframes()) {
    const SE3 expected = World::pose(static_cast<int>(index(id))) * World::pose(0).inverse();
    const SE3 T_relative =
        keyframe.T_camera_world * map.keyframe(KeyframeId{0}).T_camera_world.inverse();
    EXPECT_LT((T_relative * expected.inverse()).log().norm(), 0.01) << index(id);
  }
}

/// Labels of the features by which side of a line they are on.
template <typename Inside>
std::vector<SemanticLabel> labels_of(const map_test::SeenFrame& seen, const Inside& inside) {
  std::vector<SemanticLabel> labels;
  for (const Feature& f : seen.features->points)
    labels.push_back(inside(f.uv_px) ? SemanticLabel::kMovable : SemanticLabel::kStatic);
  return labels;
}

TEST(Mapper, AMaskTakesAwayWhatIsInsideAndTrustsWhatIsOutside) {
  World world(500, 12);
  Mapper mapper = make_mapper(world);
  const auto seen = world.see(World::pose(0), 7);
  KeyframeCandidate candidate = candidate_of(seen, kNoKeyframe, SE3());
  std::fill(candidate.static_weight.begin(), candidate.static_weight.end(), 0.3F);
  candidate.static_weight[0] = 0.0F;
  const KeyframeId id = mapper.insert(candidate);
  EXPECT_EQ(mapper.map().landmark_count(), 0U) << "nothing was surely static";
  const auto is_inside = [](const Eigen::Vector2f& uv_px) { return uv_px.x() < 200; };
  auto labels = labels_of(seen, is_inside);
  labels[1] = SemanticLabel::kUnknown;
  EXPECT_FALSE(mapper.apply_mask(KeyframeId{8}, labels)) << "no such keyframe";
  EXPECT_TRUE(mapper.apply_mask(id, labels));
  const Keyframe& keyframe = mapper.map().keyframe(id);
  EXPECT_EQ(keyframe.static_weight[1], 0.3F) << "who the mask knows nothing of stays as he was";
  for (std::uint32_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (i == 1) continue;
    const bool inside = is_inside(seen.features->points[i].uv_px);
    EXPECT_EQ(keyframe.static_weight[i], inside || i == 0 ? 0.0F : 1.0F);
    EXPECT_EQ(keyframe.landmarks[i] != kNoLandmark, !inside && i != 0);
  }
}

TEST(Mapper, AMaskRemovesLandmarksThatWereMadeInside) {
  World world(500, 13);
  Mapper mapper = make_mapper(world);
  const auto seen = world.see(World::pose(0), 0);
  const KeyframeId id = mapper.insert(candidate_of(seen, kNoKeyframe, SE3()));
  const std::size_t before = mapper.map().landmark_count();
  ASSERT_TRUE(mapper.apply_mask(
      id, labels_of(seen, [](const Eigen::Vector2f& uv_px) { return uv_px.y() < 240; })));
  EXPECT_LT(mapper.map().landmark_count(), before);
  for (const LandmarkId landmark : mapper.map().keyframe(id).landmarks) {
    if (landmark == kNoLandmark) continue;
    const std::uint32_t feature = mapper.map().landmark(landmark).observations[0].feature;
    EXPECT_GE(seen.features->points[feature].uv_px.y(), 240.0F);
  }
}

TEST(Mapper, WhatIsFixedToTheCameraLeavesAllKeyframes) {
  World world(500, 16);
  Mapper mapper = make_mapper(world);
  const auto first = world.see(World::pose(0), 0), second = world.see(World::pose(1), 1);
  mapper.insert(candidate_of(first, kNoKeyframe, SE3()));
  mapper.insert(candidate_of(second, KeyframeId{0}, first.T_camera_world));
  GreyImage mask(world.camera().width(), world.camera().height());
  for (int v = 0; v < mask.height() / 2; ++v)
    std::fill_n(mask.row(v), mask.width(), std::uint8_t{255});
  EXPECT_TRUE(mapper.forget_pixels(mask));
  int kept = 0;
  for (const auto& [id, keyframe] : mapper.map().keyframes()) {
    for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      const float v_px = std::round(keyframe.data->features->points[i].uv_px.y());
      const int half_px = mask.height() / 2;
      const bool is_masked = v_px < static_cast<float>(half_px);
      EXPECT_EQ(keyframe.static_weight[i] == 0, is_masked);
      EXPECT_TRUE(!is_masked || keyframe.landmarks[i] == kNoLandmark);
      kept += keyframe.landmarks[i] != kNoLandmark ? 1 : 0;
    }
  }
  EXPECT_GT(kept, 100);
  EXPECT_FALSE(mapper.forget_pixels(mask)) << "once is enough";
}

TEST(Mapper, F14AMaskOverEverythingDoesNotEmptyTheMap) {
  World world(500, 14);
  Mapper mapper = make_mapper(world);
  const auto seen = world.see(World::pose(0), 0);
  const KeyframeId id = mapper.insert(candidate_of(seen, kNoKeyframe, SE3()));
  const std::size_t before = mapper.map().landmark_count();
  EXPECT_FALSE(mapper.apply_mask(id, labels_of(seen, [](const Eigen::Vector2f&) { return true; })));
  EXPECT_EQ(mapper.map().landmark_count(), before);
}

TEST(ViewBuilder, HoldsNoMoreThanItMayAndPointsToWhatItHolds) {
  World world(900, 15);
  const auto truth = map_test::true_map(world, 12);
  ViewConfig config;
  config.keyframes = 4;
  config.recent_keyframes = 3;
  config.landmarks = 300;
  const KeyframeId asked[] = {KeyframeId{5}};
  const LocalViewPtr view = build_view(truth.map, KeyframeId{11}, asked, config);
  EXPECT_EQ(view->map_version, truth.map.version());
  for (const KeyframeId id : {kNoKeyframe, KeyframeId{5}, KeyframeId{11}}) {
    ASSERT_TRUE(view->pose_of(id));
    EXPECT_EQ(view->pose_of(id)->t(), truth.map.resolved_pose(id).t());
  }
  EXPECT_EQ(view->landmarks.size(), 300U);
  EXPECT_LE(view->keyframes.size(), 1U + 4U + 3U);
  EXPECT_EQ(view->reference().data->id, KeyframeId{11});
  std::set<KeyframeId> unique;
  for (const ViewKeyframe& keyframe : view->keyframes) {
    EXPECT_TRUE(unique.insert(keyframe.data->id).second);
    const Keyframe& original = truth.map.keyframe(keyframe.data->id);
    ASSERT_EQ(keyframe.landmarks.size(), original.landmarks.size());
    for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      const std::int32_t k = keyframe.landmarks[i];
      if (k >= 0) {
        ASSERT_EQ(view->landmarks[k].id, original.landmarks[i]);
      } else if (original.landmarks[i] != kNoLandmark) {
        ASSERT_EQ(view->find(original.landmarks[i]), -1);
      }
    }
  }
  for (const std::uint32_t recent : {11U, 10U, 9U})
    EXPECT_TRUE(unique.contains(KeyframeId{recent}));
}

}  // namespace
}  // namespace ygslam
