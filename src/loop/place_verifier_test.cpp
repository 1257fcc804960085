#include "loop/place_verifier.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "loop/loop_test_world.hpp"

namespace ygslam {
namespace {

using loop_test::RingWorld;
using loop_test::Walk;

PlaceView view_without_space(const Keyframe& keyframe) {
  return {*keyframe.data->features, keyframe.data->grid, keyframe.static_weight, nullptr};
}

class PlaceVerifierTest : public testing::Test {
 protected:
  RingWorld ring_{6};
  Walk walk_{.keyframes = 30, .drift_m = 0, .drift_rad = 0};
  Map map_ = ring_.walk(walk_);
  PlaceVerifier verifier_{{}, ring_.camera()};
};

TEST_F(PlaceVerifierTest, PlacesAViewThatIsNotInTheMap) {
  const SE3 T_camera_world = loop_test::ring_pose(0.2) * SE3::exp(Vec6::Constant(0.02));
  const auto seen = ring_.world().see(T_camera_world, 1000);
  const std::vector<float> weight(seen.features->size(), 1);
  const PlaceMatch match =
      verifier_.verify(map_, {*seen.features, seen.grid, weight}, KeyframeId{8}, 1);
  EXPECT_EQ(match.verdict, PlaceVerdict::kAgrees);
  EXPECT_LT((match.T_camera_world * T_camera_world.inverse()).log().norm(), 0.005);
  EXPECT_GE(match.inliers, 25);
}

TEST_F(PlaceVerifierTest, AnotherPlaceDoesNotAgree) {
  const Keyframe& view = map_.keyframe(KeyframeId{29});
  const PlaceMatch match = verifier_.verify(map_, view_without_space(view), KeyframeId{0}, 1);
  EXPECT_THAT(match.verdict, testing::AnyOf(PlaceVerdict::kFewMatches, PlaceVerdict::kNoPose,
                                            PlaceVerdict::kFewInliers));
}

TEST_F(PlaceVerifierTest, OneCornerOfTheImageIsNotEnough) {
  const Keyframe& view = map_.keyframe(KeyframeId{8});
  std::vector<float> weight = view.static_weight;
  for (std::size_t i = 0; i < weight.size(); ++i) {
    const auto& uv_px = view.data->features->points[i].uv_px;
    if (uv_px.x() > 300 || uv_px.y() > 230) weight[i] = 0;
  }
  const PlaceMatch match =
      verifier_.verify(map_, {*view.data->features, view.data->grid, weight}, KeyframeId{9}, 1);
  EXPECT_EQ(match.verdict, PlaceVerdict::kNarrow);
}

TEST_F(PlaceVerifierTest, SeeingThroughWhatStoodThereContradicts) {
  const Keyframe& view = map_.keyframe(KeyframeId{8});
  DepthImage far_m(640, 480);
  for (float& d : far_m) d = 20;
  const FreeSpaceImage space(far_m);
  PlaceView seen = view_without_space(view);
  EXPECT_EQ(verifier_.verify(map_, seen, KeyframeId{9}, 1).verdict, PlaceVerdict::kAgrees);
  seen.free_space = &space;
  const PlaceMatch match = verifier_.verify(map_, seen, KeyframeId{9}, 1);
  EXPECT_EQ(match.verdict, PlaceVerdict::kContradicts);
  EXPECT_GT(match.contradiction, 0.9);
}

TEST_F(PlaceVerifierTest, TheFirstCheckThatFailsIsTold) {
  const Keyframe& view = map_.keyframe(KeyframeId{8});
  PlaceVerifierConfig config;
  const auto verdict = [&] {
    return PlaceVerifier(config, ring_.camera())
        .verify(map_, view_without_space(view), KeyframeId{9}, 1)
        .verdict;
  };
  ASSERT_EQ(verdict(), PlaceVerdict::kAgrees);
  config.min_extent_m = 50;
  EXPECT_EQ(verdict(), PlaceVerdict::kNarrow) << "in space";
  config.min_cells = 17;
  EXPECT_EQ(verdict(), PlaceVerdict::kNarrow);
  config.min_inlier_share = 1.1;
  EXPECT_EQ(verdict(), PlaceVerdict::kFewInliers);
  config.min_inlier_share = 0;
  config.min_inliers = 100'000;
  EXPECT_EQ(verdict(), PlaceVerdict::kFewInliers);
  config.min_matches = 100'000;
  EXPECT_EQ(verdict(), PlaceVerdict::kFewMatches);
}

TEST_F(PlaceVerifierTest, WithoutWeightNothingMatches) {
  const Keyframe& view = map_.keyframe(KeyframeId{8});
  const std::vector<float> none(view.static_weight.size(), 0);
  const PlaceMatch match =
      verifier_.verify(map_, {*view.data->features, view.data->grid, none}, KeyframeId{9}, 1);
  EXPECT_EQ(match.verdict, PlaceVerdict::kFewMatches);
  EXPECT_EQ(match.matches, 0);
}

TEST_F(PlaceVerifierTest, BesideAVerifiedViewAGuessWillDoIfItIsNear) {
  const Keyframe& view = map_.keyframe(KeyframeId{8});
  const auto from = [&](double off_rad) {
    const SE3 T_guess = SE3(so3_exp(Vec3(0, off_rad, 0)), Vec3::Zero()) * view.T_camera_world;
    return verifier_.verify_near(map_, view_without_space(view), KeyframeId{9}, T_guess);
  };
  const PlaceMatch near = from(0.01);
  EXPECT_EQ(near.verdict, PlaceVerdict::kAgrees);
  EXPECT_EQ(near.place, KeyframeId{9});
  EXPECT_LT((near.T_camera_world * view.T_camera_world.inverse()).log().norm(), 0.005);
  EXPECT_EQ(from(0.3).verdict, PlaceVerdict::kFewInliers);
}

TEST_F(PlaceVerifierTest, WhatStandsWhereTheViewSeesThroughContradictsEitherWay) {
  const Keyframe& view = map_.keyframe(KeyframeId{8});
  // Everything that the view shows stands half as far away as the keyframes of the place saw.
  const FreeSpaceImage far(DepthImage(640, 480, 20));
  Map map({map_test::kLevels, map_test::kScale});
  for (const auto& [id, keyframe] : map_.keyframes()) {
    auto data = std::make_shared<KeyframeData>(*keyframe.data);
    data->free_space = far;
    map.add_keyframe(std::move(data), keyframe.T_camera_world, keyframe.parent,
                     keyframe.static_weight);
  }
  map_.for_each_landmark([&](const Landmark& landmark) {
    LandmarkId added = kNoLandmark;
    for (const auto& [id, feature] : landmark.observations) {
      if (added == kNoLandmark) {
        added = map.add_landmark(landmark.p_world, id, feature);
      } else {
        map.add_observation(added, id, feature);
        map.refresh(added);
      }
    }
  });
  const PlaceMatch match = verifier_.verify(map, view_without_space(view), KeyframeId{9}, 1);
  EXPECT_EQ(match.verdict, PlaceVerdict::kContradicts);
}

TEST(PlaceVerdict, HasANameForEach) {
  using enum PlaceVerdict;
  std::set<std::string> names;
  for (const PlaceVerdict verdict :
       {kFewMatches, kNoPose, kFewInliers, kNarrow, kContradicts, kAgrees})
    names.insert(to_string(verdict));
  EXPECT_EQ(names.size(), 6U);
  EXPECT_FALSE(names.contains("?"));
}

}  // namespace
}  // namespace ygslam
