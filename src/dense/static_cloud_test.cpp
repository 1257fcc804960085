#include "dense/static_cloud.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/rng.hpp"
#include "geometry/rolling_shutter.hpp"

namespace ygslam {
namespace {

Camera small_camera() {
  CameraConfig c;
  c.fx = c.fy = 130, c.cx = 79.5, c.cy = 59.5, c.width = 160, c.height = 120;
  return Camera(c);
}

/// What the camera sees of the plane z = distance_m of the world, its columns coloured by u.
RgbdFrame plane_view(const Camera& camera, const SE3& T_world_camera, double distance_m) {
  RgbdFrame frame;
  frame.id = FrameId{0};
  frame.colour = ColourImage(camera.width(), camera.height());
  frame.depth_m = DepthImage(camera.width(), camera.height());
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const Vec3 ray = T_world_camera.R() * camera.unproject({u, v}, 1.0);
      const double depth_m = (distance_m - T_world_camera.t().z()) / ray.z();
      frame.depth_m.at(u, v) = static_cast<float>(depth_m);
      frame.colour.at(u, v) = {static_cast<std::uint8_t>(u), 40, 200};
    }
  }
  return frame;
}

StaticCloudConfig every_pixel() {
  StaticCloudConfig config;
  config.min_points = 1;
  config.pixel_stride = 1;
  config.margin_px = 0;
  return config;
}

SE3 pose(double x, double yaw) { return SE3(so3_exp(Vec3(0, yaw, 0.02)), Vec3(x, 0.05, -0.1)); }

TEST(StaticCloud, APlaneComesOutWhereItIs) {
  const Camera camera = small_camera();
  StaticCloud cloud(every_pixel(), camera);
  std::map<KeyframeId, SE3> poses;
  for (std::uint32_t i = 0; i < 3; ++i) {
    poses[KeyframeId{i}] = pose(0.1 * i, 0.1 * i - 0.1);
    cloud.insert(KeyframeId{i}, plane_view(camera, poses[KeyframeId{i}], 2.005), {});
  }
  const auto points = cloud.build(poses);
  ASSERT_GT(points.size(), 5000U);
  for (const ColouredPoint& p : points) {
    ASSERT_NEAR(p.p_world.z(), 2.005F, 2e-4F);
    ASSERT_EQ(p.colour.g, 40);
    ASSERT_EQ(p.colour.b, 200);
  }
  // At most one point per voxel.
  std::map<std::array<int, 2>, int> voxels;
  for (const ColouredPoint& p : points)
    ++voxels[{static_cast<int>(std::floor(p.p_world.x() / 0.01F)),
              static_cast<int>(std::floor(p.p_world.y() / 0.01F))}];
  EXPECT_GT(voxels.size(), 0.97 * static_cast<double>(points.size()));
}

TEST(StaticCloud, EachRowOfAMovingCameraIsPutWhereItWasSeen) {
  CameraConfig config = small_camera().config();
  config.depth_readout_ms = 30;
  config.depth_delay_ms = 4;
  const Camera camera(config);
  Vec6 velocity;
  velocity << 0.3, -0.2, 0.4, 0.6, -0.9, 0.3;
  const ReadOut read_out{shutter_times(config), velocity};
  const RollingShutter shutter(camera.height(), read_out);
  RgbdFrame frame = plane_view(camera, SE3(), 2.005);
  for (int v = 0; v < camera.height(); ++v) {
    const SE3 T_world_row = SE3::exp(shutter.depth_time_s(v) * velocity);
    for (int u = 0; u < camera.width(); ++u) {
      const Vec3 ray = T_world_row.R() * camera.unproject(Vec2(u, v), 1.0);
      frame.depth_m.at(u, v) = static_cast<float>((2.005 - T_world_row.t().z()) / ray.z());
    }
  }
  StaticCloudConfig every = every_pixel();
  every.min_points = 1;
  StaticCloud cloud(every, camera);
  cloud.insert(KeyframeId{0}, frame, {}, read_out);
  const auto points = cloud.build({{KeyframeId{0}, SE3()}});
  ASSERT_GT(points.size(), 1000U);
  for (const ColouredPoint& p : points) ASSERT_NEAR(p.p_world.z(), 2.005F, 3e-4F);
}

TEST(StaticCloud, FollowsCorrectedPosesAndForgetsRemovedKeyframes) {
  const Camera camera = small_camera();
  StaticCloud cloud(every_pixel(), camera);
  cloud.insert(KeyframeId{0}, plane_view(camera, SE3(), 2.0), {});
  cloud.insert(KeyframeId{1}, plane_view(camera, SE3(), 3.0), {});
  const SE3 lifted(Mat3::Identity(), Vec3(0, 0, 0.5));
  for (const ColouredPoint& p : cloud.build({{KeyframeId{0}, lifted}}))
    ASSERT_NEAR(p.p_world.z(), 2.5F, 2e-4F) << "keyframe 1 has no pose and is left out";
  cloud.remove(KeyframeId{0});
  const auto rest = cloud.build({{KeyframeId{0}, SE3()}, {KeyframeId{1}, SE3()}});
  ASSERT_FALSE(rest.empty());
  for (const ColouredPoint& p : rest) ASSERT_NEAR(p.p_world.z(), 3.0F, 2e-4F);
}

TEST(StaticCloud, NothingComesFromMaskedPixelsOrTheirMargin) {
  const Camera camera = small_camera();
  StaticCloudConfig config = every_pixel();
  config.margin_px = 4;
  StaticCloud cloud(config, camera);
  RgbdFrame frame = plane_view(camera, SE3(), 2.0);
  GreyImage mask(camera.width(), camera.height());
  for (int v = 40; v < 80; ++v)
    for (int u = 60; u < 100; ++u) mask.at(u, v) = 255;
  cloud.insert(KeyframeId{0}, frame, mask);
  const auto points = cloud.build({{KeyframeId{0}, SE3()}});
  ASSERT_FALSE(points.empty());
  for (const ColouredPoint& p : points) {
    const Vec2 px = camera.project(p.p_world.cast<double>());
    // A voxel may average two pixels: half a pixel of slack.
    const bool inside = px.x() > 56.5 && px.x() < 102.5 && px.y() > 36.5 && px.y() < 82.5;
    ASSERT_FALSE(inside) << px.transpose();
  }
}

TEST(StaticCloud, LeavesOutDepthEdgesFarDepthAndLoneMeasurements) {
  const Camera camera = small_camera();
  RgbdFrame frame = plane_view(camera, SE3(), 2.0);
  for (int v = 0; v < 120; ++v)
    for (int u = 80; u < 160; ++u) frame.depth_m.at(u, v) = v < 60 ? 3.0F : 5.0F;
  StaticCloud cloud(every_pixel(), camera);
  cloud.insert(KeyframeId{0}, frame, {});
  for (const ColouredPoint& p : cloud.build({{KeyframeId{0}, SE3()}})) {
    ASSERT_LT(p.p_world.z(), 4.0F);
    const Vec2 px = camera.project(p.p_world.cast<double>());
    ASSERT_GT(std::abs(px.x() - 79.5), 1.0) << "a pixel at the step";
  }
  StaticCloudConfig sure = every_pixel();
  sure.min_points = 3;
  sure.voxel_m = 0.001;  // smaller than a pixel: one measurement each
  StaticCloud lonely(sure, camera);
  lonely.insert(KeyframeId{0}, plane_view(camera, SE3(), 2.0), {});
  EXPECT_TRUE(lonely.build({{KeyframeId{0}, SE3()}}).empty());
}

TEST(Dilated, EqualsBruteForce) {
  Rng rng(3);
  for (int trial = 0; trial < 20; ++trial) {
    GreyImage mask(static_cast<int>(1 + rng.below(40)), static_cast<int>(1 + rng.below(30)));
    for (auto& pixel : mask) pixel = rng.below(30) == 0 ? 255 : 0;
    const int radius_px = static_cast<int>(rng.below(6));
    const GreyImage grown = dilated(mask, radius_px);
    ASSERT_TRUE(grown.same_size(mask));
    for (int v = 0; v < mask.height(); ++v) {
      for (int u = 0; u < mask.width(); ++u) {
        bool near = false;
        for (int dv = -radius_px; dv <= radius_px; ++dv)
          for (int du = -radius_px; du <= radius_px; ++du)
            near |= mask.contains(u + du, v + dv) && mask.at(u + du, v + dv) != 0;
        ASSERT_EQ(grown.at(u, v) != 0, near) << u << ' ' << v << " radius " << radius_px;
      }
    }
  }
  EXPECT_TRUE(dilated({}, 5).empty());
}

}  // namespace
}  // namespace ygslam
