#include "system/result_route.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

FramePtr numbered_frame(std::uint32_t number, double t_s = 0) {
  auto frame = std::make_shared<RgbdFrame>();
  frame->id = FrameId{number};
  frame->stamp.ns = static_cast<std::int64_t>(1e9 * t_s);
  return frame;
}

TrackResult track_result(TrackState state) {
  TrackResult result;
  result.state = state;
  result.features = std::make_shared<const Features>();
  result.labels.label = {MotionLabel::kStatic, MotionLabel::kDynamic};
  result.labels.weight = {1, 0};
  result.pose.reference = KeyframeId{7};
  return result;
}

MappingStageConfig expecting_masks() {
  MappingStageConfig config;
  config.expects_masks = true;
  return config;
}

TEST(ResultRoute, AFrameIsAKeyframeOrADenseFrameOrNeither) {
  ResultRoute route(DenseMapConfig{}, expecting_masks());
  TrackResult found = track_result(TrackState::kTracking);
  const auto first = route.frame_message(numbered_frame(0), found);
  ASSERT_TRUE(first);
  const auto* dense = std::get_if<DenseFrameMessage>(&*first);
  ASSERT_NE(dense, nullptr);
  EXPECT_EQ(dense->pose.reference, KeyframeId{7});
  EXPECT_EQ(dense->labels, found.labels.label);
  EXPECT_FALSE(route.frame_message(numbered_frame(1, 0.01), found)) << "one was offered just now";

  found.candidate.emplace();
  found.candidate->features = found.features;
  found.candidate->map_version = 5;
  const auto second = route.frame_message(numbered_frame(2, 100), found);
  ASSERT_TRUE(second);
  const auto* keyframe = std::get_if<KeyframeMessage>(&*second);
  ASSERT_NE(keyframe, nullptr);
  EXPECT_EQ(keyframe->candidate.map_version, 5U);
  EXPECT_EQ(keyframe->labels, found.labels.label);
  EXPECT_TRUE(found.candidate) << "whoever gets the result sees that it is one";
}

TEST(ResultRoute, WhatIsFixedToTheCameraIsToldToTheMapAndKeptOutOfTheDenseMap) {
  auto frame = std::make_shared<RgbdFrame>(*numbered_frame(0));
  frame->depth_m = DepthImage(4, 2, 1.5F);
  auto mask = std::make_shared<GreyImage>(4, 2);
  mask->at(1, 0) = 255;
  TrackResult found = track_result(TrackState::kTracking);
  found.ego_mask = found.masked_pixels = mask;
  ResultRoute route(DenseMapConfig{}, expecting_masks());
  const auto message = route.frame_message(frame, found);
  ASSERT_TRUE(message);
  const DepthImage& depth_m = std::get<DenseFrameMessage>(*message).frame->depth_m;
  EXPECT_EQ(depth_m.at(1, 0), 0);
  EXPECT_EQ(depth_m.at(2, 0), 1.5F);
  EXPECT_TRUE(ResultRoute::requests(*frame, found).empty()) << "nothing new";
  found.ego_mask_grew = true;
  const auto requests = ResultRoute::requests(*frame, found);
  ASSERT_EQ(requests.size(), 1U);
  EXPECT_EQ(std::get<PixelMaskPtr>(requests.front()), found.ego_mask);
}

TEST(ResultRoute, AKeyframeOfAnEarlierFrameGetsNoLabelsOfThisOne) {
  ResultRoute route(DenseMapConfig{}, expecting_masks());
  TrackResult found = track_result(TrackState::kTracking);
  found.candidate.emplace();  // the very first, where the shutter had to be looked at
  found.candidate->features = std::make_shared<const Features>();
  const auto message = route.frame_message(numbered_frame(1), found);
  ASSERT_TRUE(message);
  EXPECT_TRUE(std::get<KeyframeMessage>(*message).labels.empty());
}

TEST(ResultRoute, NoDenseFrameIsOfferedWhereNoneCanEnter) {
  MappingStageConfig frozen = expecting_masks();
  frozen.frozen = true;
  DenseMapConfig none;
  none.enabled = false;
  TrackResult found = track_result(TrackState::kTracking);
  for (ResultRoute route :
       {ResultRoute(DenseMapConfig{}, MappingStageConfig{}), ResultRoute(DenseMapConfig{}, frozen),
        ResultRoute(none, expecting_masks())})
    EXPECT_FALSE(route.frame_message(numbered_frame(0), found));
}

TEST(ResultRoute, NothingIsAskedOfTheMapWhileAllIsWell) {
  TrackResult found = track_result(TrackState::kTracking);
  found.shutter.emplace();
  found.shutter->taken_over = false;
  EXPECT_TRUE(ResultRoute::requests(*numbered_frame(10), found).empty());
}

TEST(ResultRoute, ALostCameraAsksWithoutAPoseAndOneInASubmapWithIt) {
  const auto lost = ResultRoute::requests(*numbered_frame(3), track_result(TrackState::kLost));
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_FALSE(std::get<PlaceRequest>(lost.front()).pose);

  TrackResult unplaced = track_result(TrackState::kTracking);
  unplaced.unplaced = true;
  EXPECT_TRUE(ResultRoute::requests(*numbered_frame(3), unplaced).empty())
      << "now and then is enough";
  const auto asked = ResultRoute::requests(*numbered_frame(20), unplaced);
  ASSERT_EQ(asked.size(), 1U);
  const auto& request = std::get<PlaceRequest>(asked.front());
  ASSERT_TRUE(request.pose);
  EXPECT_EQ(request.pose->reference, KeyframeId{7});
  EXPECT_EQ(request.features, unplaced.features);
  EXPECT_EQ(request.static_weight, unplaced.labels.weight);
}

TEST(ResultRoute, PixelsArePutRightBeforePlacesAreLookedFor) {
  TrackResult found = track_result(TrackState::kWeak);
  found.unplaced = true;
  found.wanted_view = KeyframeId{4};
  found.shutter.emplace();
  found.shutter->taken_over = true;
  const auto requests = ResultRoute::requests(*numbered_frame(0), found);
  ASSERT_EQ(requests.size(), 3U);
  EXPECT_TRUE(std::holds_alternative<ShutterReport>(requests[0]));
  EXPECT_TRUE(std::holds_alternative<PlaceRequest>(requests[1]));
  EXPECT_EQ(std::get<KeyframeId>(requests[2]), KeyframeId{4});
}

}  // namespace
}  // namespace ygslam
