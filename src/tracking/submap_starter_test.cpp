// A keyframe that saw 3 m far, and what a camera sees that was lost there.
#include "tracking/submap_starter.hpp"

#include <gtest/gtest.h>

#include "geometry/geometry_testing.hpp"

namespace ygslam {
namespace {

constexpr int kPoints = 150;
constexpr float kSeen_m = 3.0F;
constexpr double kTravelled_m = 1.2;
constexpr int kFramesOfASecond = 10;

struct LostCamera {
  explicit LostCamera(bool enabled = true, int min_points = 100)
      : starter(enabled, min_points, FreeSpaceConfig{}, camera) {
    auto data = std::make_shared<KeyframeData>();
    data->free_space = FreeSpaceImage(DepthImage(640, 480, kSeen_m));
    view.keyframes.push_back({std::move(data), SE3(), {}, 0});
  }
  std::optional<double> see(float depth_m = kSeen_m, bool too_few_static = false) {
    return starter.consider(frame(depth_m), too_few_static, view, T_last_world, travelled_m);
  }
  /// How many of 100 frames it takes; 0: none of them begins a submap.
  int frames_until_it_begins(float depth_m = kSeen_m, bool too_few_static = false) {
    for (int frames = 1; frames <= 100; ++frames)
      if (see(depth_m, too_few_static)) return frames;
    return 0;
  }

  Camera camera = geometry_test::test_camera();
  LocalView view;
  std::optional<SE3> T_last_world = SE3();
  double travelled_m = kTravelled_m;
  SubmapStarter starter;

 private:
  [[nodiscard]] FrameFeatures frame(float depth_m) {
    auto image = std::make_shared<RgbdFrame>();
    image->stamp = {to_ns(static_cast<double>(number_++) / kFramesOfASecond)};
    auto features = std::make_shared<Features>();
    for (int k = 0; k < kPoints; ++k) {
      Feature f;
      const int row = k / 15;
      f.uv_px =
          f.ideal_px = {static_cast<float>(60 + 35 * (k % 15)), static_cast<float>(60 + 35 * row)};
      f.depth_m = depth_m;
      features->points.push_back(f);
      features->descriptors.emplace_back();
    }
    FeatureGrid grid(*features, camera.ideal_bounds());
    return {std::move(image),
            std::move(features),
            std::move(grid),
            {},
            std::vector<float>(kPoints, 1.0F)};
  }
  int number_ = 0;
};

TEST(SubmapStarter, BeginsAfterASecondOfFramesThatWouldDo) {
  LostCamera camera;
  EXPECT_EQ(camera.frames_until_it_begins(), kFramesOfASecond + 1);
  EXPECT_EQ(camera.frames_until_it_begins(), kFramesOfASecond + 1) << "and again";
}

TEST(SubmapStarter, ASecondIsCountedFromTheLastFrameThatWouldNotDo) {
  LostCamera camera;
  for (int i = 0; i < kFramesOfASecond; ++i) ASSERT_FALSE(camera.see());
  EXPECT_FALSE(camera.see(0));
  EXPECT_EQ(camera.frames_until_it_begins(), kFramesOfASecond);
  for (int i = 0; i < kFramesOfASecond; ++i) ASSERT_FALSE(camera.see());
  camera.starter.forget();
  EXPECT_EQ(camera.frames_until_it_begins(), kFramesOfASecond + 1) << "it had a place meanwhile";
}

TEST(SubmapStarter, TooFewPointsAreNoStart) {
  EXPECT_EQ(LostCamera().frames_until_it_begins(0), 0) << "no depth";
  EXPECT_EQ(LostCamera(true, kPoints + 1).frames_until_it_begins(), 0);
  EXPECT_GT(LostCamera(true, kPoints).frames_until_it_begins(), 0);
  EXPECT_EQ(LostCamera().frames_until_it_begins(kSeen_m, true), 0)
      << "points that came back only because there were too few others";
}

TEST(SubmapStarter, SomethingBeforeTheLensIsNoStart) {
  LostCamera camera;
  EXPECT_EQ(camera.frames_until_it_begins(0.5F), 0);
  EXPECT_EQ(camera.frames_until_it_begins(), kFramesOfASecond) << "but what was behind it is";
  camera.T_last_world.reset();
  EXPECT_GT(camera.frames_until_it_begins(0.5F), 0) << "of a camera that never was anywhere";
  LostCamera turned;
  turned.T_last_world = SE3(so3_exp(Vec3(0, 3, 0)), Vec3::Zero());
  EXPECT_GT(turned.frames_until_it_begins(0.5F), 0) << "the keyframe did not look there";
}

TEST(SubmapStarter, ItReachesAsFarAsTheCameraCanHaveComeOrNowhere) {
  const auto reach_m = [](LostCamera camera) {
    for (int i = 0; i < kFramesOfASecond; ++i) EXPECT_FALSE(camera.see());
    return camera.see();
  };
  LostCamera camera;
  EXPECT_EQ(reach_m(camera), kTravelled_m);
  camera.travelled_m = 30;
  EXPECT_EQ(reach_m(camera), 2) << "farther away the next room may look the same";
  camera.view.placed = false;
  EXPECT_EQ(reach_m(camera), 0) << "it was in a submap";
}

TEST(SubmapStarter, WithoutAMapOrWhereItIsSwitchedOffNoneBegins) {
  EXPECT_EQ(LostCamera(false).frames_until_it_begins(), 0);
  EXPECT_FALSE(LostCamera(false).starter.enabled());
  LostCamera alone;
  alone.view.keyframes.clear();
  EXPECT_EQ(alone.frames_until_it_begins(), 0);
}

}  // namespace
}  // namespace ygslam
