// A wall at 3 m that a keyframe has seen, and things before it.
#include "tracking/free_space_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace ygslam {
namespace {

constexpr float kWall_m = 3.0F;

Camera camera() { return Camera({.fx = 500, .fy = 500, .cx = 319.5, .cy = 239.5}); }

std::shared_ptr<const KeyframeData> keyframe(const DepthImage& depth_m) {
  auto data = std::make_shared<KeyframeData>();
  data->free_space = FreeSpaceImage(depth_m);
  return data;
}

LocalView view_of(const DepthImage& depth_m) {
  LocalView view;
  view.keyframes.push_back({keyframe(depth_m), SE3(), {}, 0});
  return view;
}

/// Features on a lattice: 5 x 5 on the wall and on the map at the left, the rest new at the right.
struct Scene {
  explicit Scene(float right_m, int on_map = 25) {
    auto features = std::make_shared<Features>();
    for (int k = 0; k < 50; ++k) {
      Feature f;
      const bool right = k >= 25;
      f.uv_px = {static_cast<float>((right ? 400 : 80) + 30 * (k % 5)),
                 static_cast<float>(100 + 30 * (k / 5 % 5))};
      f.ideal_px = f.uv_px;
      f.depth_m = right ? right_m : kWall_m;
      features->points.push_back(f);
      features->descriptors.emplace_back();
      landmarks.push_back(k < on_map ? LandmarkId{static_cast<std::uint32_t>(k)} : kNoLandmark);
    }
    image->depth_m = DepthImage(640, 480, kWall_m);
    for (int v = 0; v < 480; ++v) std::fill_n(image->depth_m.row(v) + 320, 320, right_m);
    frame.frame = image;
    frame.grid = FeatureGrid(*features, cam.ideal_bounds());
    frame.features = std::move(features);
    frame.static_weight.assign(50, 0.6F);
  }
  [[nodiscard]] int violations(const LocalView& view, const SE3& T_camera_world = SE3(),
                               const std::vector<std::uint8_t>& known = {}) const {
    int count = 0;
    for (const auto i : find_free_space_violations(cam, frame, landmarks, known, view,
                                                   T_camera_world, FreeSpaceConfig{}))
      count += i;
    return count;
  }

  Camera cam = camera();
  std::shared_ptr<RgbdFrame> image = std::make_shared<RgbdFrame>();
  FrameFeatures frame;
  std::vector<LandmarkId> landmarks;
};

const DepthImage kWall(640, 480, kWall_m);

TEST(FreeSpaceCheck, WhatStandsWhereTheKeyframeSawTheWallIsOne) {
  EXPECT_EQ(Scene(1.0F).violations(view_of(kWall)), 25);
  EXPECT_EQ(Scene(kWall_m).violations(view_of(kWall)), 0);
  EXPECT_EQ(Scene(kWall_m - 0.2F).violations(view_of(kWall)), 0) << "within the margin";
  EXPECT_EQ(Scene(5.0F).violations(view_of(kWall)), 0) << "behind the wall nobody saw";
}

TEST(FreeSpaceCheck, AHoleInDepthWhereTheKeyframeSawTheWallIsSomethingTooNear) {
  const Scene hole(0.0F);
  EXPECT_EQ(hole.violations(view_of(kWall)), 25);
  DepthImage same_hole = kWall;
  for (int v = 0; v < 480; ++v) std::fill_n(same_hole.row(v) + 320, 320, 0.0F);
  EXPECT_EQ(hole.violations(view_of(same_hole)), 0) << "dark or shiny: it never gave depth";
  LocalView view = view_of(same_hole);
  for (int i = 0; i < FreeSpaceConfig{}.keyframes; ++i) view.keyframes.push_back(view.keyframes[0]);
  view.keyframes.push_back(view_of(kWall).keyframes[0]);
  EXPECT_EQ(hole.violations(view), 25) << "those made since it came do not know";
}

TEST(FreeSpaceCheck, ASensorThatFailsLeavesNoHoles) {
  Scene single(0.0F);
  single.image->depth_m = kWall;
  EXPECT_EQ(single.violations(view_of(kWall)), 0) << "depth is measured about the points";
  Scene failing(0.0F);
  auto features = std::make_shared<Features>(*failing.frame.features);
  for (std::size_t i = 0; i < 10; ++i) features->points[i].depth_m = 0;
  failing.frame.features = features;
  EXPECT_EQ(failing.violations(view_of(kWall)), 0) << "on the map it measures little, too";
}

TEST(FreeSpaceCheck, NobodyKnowsWhatAKeyframeDidNotSee) {
  const Scene scene(1.0F);
  EXPECT_EQ(scene.violations(LocalView{}), 0);
  EXPECT_EQ(scene.violations(view_of(DepthImage(640, 480, 0.0F))), 0);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(scene.violations(view_of(DepthImage(640, 480, nan))), 0);
  LocalView elsewhere = view_of(kWall);
  elsewhere.keyframes[0].T_camera_world = SE3(Mat3::Identity(), Vec3(0, 0, -2));
  EXPECT_EQ(scene.violations(elsewhere), 0) << "behind that camera";
}

TEST(FreeSpaceCheck, ASurfaceThatAnyKeyframeSawThereClears) {
  LocalView view = view_of(kWall);
  view.keyframes.push_back({keyframe(DepthImage(640, 480, 1.0F)), SE3(), {}, 0});
  EXPECT_EQ(Scene(1.0F).violations(view), 0);
}

TEST(FreeSpaceCheck, WhatAKeyframeKnewToBeNoPartOfTheWorldIsForgotten) {
  const std::vector<Vec3> movers = {{100, 100, 1.02}, {300, 100, 2.0}, {1e9, 0, 1}};
  const FreeSpaceImage nearest(DepthImage(640, 480, 1.0F), movers);
  EXPECT_EQ(nearest.around_m({100, 100}), 0);
  EXPECT_EQ(nearest.around_m({300, 100}), 1.0F) << "another surface";
  EXPECT_EQ(nearest.around_m({-3, 100}), 0);
  EXPECT_EQ(nearest.around_m({1e30, 0}), 0);
  EXPECT_EQ(FreeSpaceImage().around_m({1, 1}), 0);
}

TEST(FreeSpaceCheck, NearEdgesTheNearerSurfaceCounts) {
  DepthImage depth_m = kWall;
  for (int v = 0; v < 480; ++v) depth_m.at(200, v) = 1.5F;
  const FreeSpaceImage nearest(depth_m);
  EXPECT_EQ(nearest.around_m({195, 50}), 1.5F);
  EXPECT_EQ(nearest.around_m({212, 50}), 1.5F);
  EXPECT_EQ(nearest.around_m({230, 50}), kWall_m);
}

TEST(FreeSpaceCheck, AWrongPoseOrTooLittleOfTheMapJudgesNobody) {
  const Scene scene(1.0F);
  const SE3 too_near(Mat3::Identity(), Vec3(0, 0, 1.5));  // all seems 1.5 m nearer than it was
  EXPECT_EQ(scene.violations(view_of(kWall), too_near), 0);
  EXPECT_EQ(Scene(1.0F, 10).violations(view_of(kWall)), 0);
}

TEST(FreeSpaceCheck, KnownOnesStayWhereTheMapIsSilentAndTakeInTheirLike) {
  const Scene scene(1.0F, 10);  // too little of the map to judge by
  std::vector<std::uint8_t> known(50, 0);
  for (std::size_t i = 25; i < 40; ++i) known[i] = 1;
  EXPECT_EQ(scene.violations(view_of(kWall), SE3(), known), 25);
  for (std::size_t i = 0; i < 15; ++i) std::swap(known[i], known[i + 25]);
  const Scene on_wall(1.0F);
  EXPECT_EQ(on_wall.violations(LocalView{}, SE3(), known), 0) << "on the map they are none";
}

TEST(FreeSpaceCheck, ALoneOneIsABadDepth) {
  Scene scene(kWall_m);
  auto features = std::make_shared<Features>(*scene.frame.features);
  features->points[30].depth_m = 1.0F;
  scene.frame.features = features;
  EXPECT_EQ(scene.violations(view_of(kWall)), 0);
}

}  // namespace
}  // namespace ygslam
