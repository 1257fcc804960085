#include "io/depth_registration.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace ygslam {
namespace {

CameraConfig lens(int width, int height, double f) {
  CameraConfig c;
  c.width = width, c.height = height;
  c.fx = c.fy = f;
  c.cx = width / 2.0 - 0.5, c.cy = height / 2.0 - 0.5;
  return c;
}

SE3 beside(double x_m, double turn_rad = 0) {
  return {so3_exp({0.3 * turn_rad, turn_rad, -0.2 * turn_rad}), {x_m, 0.004, -0.002}};
}

SE3 rolled(double roll_deg) {
  return {so3_exp({0, 0, roll_deg * std::numbers::pi / 180}), {0.08, -0.05, 0.002}};
}

/// Depth of the plane n * p = d (colour frame) as a camera at T_colour_camera sees it.
DepthImage plane_seen(const CameraConfig& config, const SE3& T_colour_camera, const Vec3& normal,
                      double d) {
  const Camera camera(config);
  DepthImage depth_m(config.width, config.height);
  for (int v = 0; v < config.height; ++v)
    for (int u = 0; u < config.width; ++u) {
      const Vec3 ray =
          camera.unproject(camera.undistort({static_cast<double>(u), static_cast<double>(v)}), 1);
      const double z_m =
          (d - normal.dot(T_colour_camera.t())) / normal.dot(T_colour_camera.R() * ray);
      depth_m.at(u, v) = z_m > 0 ? static_cast<float>(z_m) : 0.0F;
    }
  return depth_m;
}

struct Pair {
  const char* name;
  CameraConfig colour, depth;
  SE3 T_colour_depth;
};

std::vector<Pair> pairs() {
  CameraConfig bent = lens(160, 120, 140);
  bent.k1 = 0.1, bent.k2 = -0.3, bent.p1 = 0.002, bent.k3 = 0.1;
  return {{"beside", lens(160, 120, 140), lens(160, 120, 150), beside(0.03)},
          {"turned", lens(160, 120, 140), lens(160, 120, 130), beside(-0.05, 0.05)},
          {"coarse depth", lens(320, 240, 280), lens(80, 60, 66), beside(0.02, 0.01)},
          {"fine depth", lens(80, 60, 70), lens(320, 240, 270), beside(0.02, -0.02)},
          {"bent lenses", bent, bent, beside(0.03, 0.02)},
          {"rolled by 30", lens(160, 120, 140), lens(160, 120, 110), rolled(30)},
          {"rolled by 90", lens(160, 120, 140), lens(160, 120, 110), rolled(90)},
          {"rolled by 135", lens(160, 120, 140), lens(160, 120, 110), rolled(135)},
          {"upside down", lens(160, 120, 140), lens(160, 120, 130), rolled(180)}};
}

// A plane, upright or steep, arrives as the colour camera sees it, without a hole in the middle.
TEST(DepthRegistration, PlanesAreWhatTheColourCameraSees) {
  for (const Pair& pair : pairs())
    for (const Vec3& slanted : {Vec3(0, 0, 1), Vec3(0.8, 0.1, 1), Vec3(-0.9, 0.5, 1)}) {
      const Vec3 normal = slanted.normalized();
      const DepthImage truth_m = plane_seen(pair.colour, SE3(), normal, 1.5);
      const DepthRegistration registration({pair.depth, pair.T_colour_depth}, pair.colour);
      const DepthImage got_m =
          registration.registered(plane_seen(pair.depth, pair.T_colour_depth, normal, 1.5));
      ASSERT_TRUE(got_m.same_size(truth_m));
      const double coarse = pair.colour.fx / pair.depth.fx;  // colour pixels of a depth pixel
      int holes = 0, seen = 0;
      double worst = 0;
      for (int v = got_m.height() / 6; v < got_m.height() * 5 / 6; ++v)
        for (int u = got_m.width() / 6; u < got_m.width() * 5 / 6; ++u) {
          ++seen;
          if (!(got_m.at(u, v) > 0)) {
            ++holes;
            continue;
          }
          const double slope = std::max({std::abs(truth_m.at(u + 1, v) - truth_m.at(u, v)),
                                         std::abs(truth_m.at(u, v + 1) - truth_m.at(u, v))});
          const double off_m = std::abs(got_m.at(u, v) - truth_m.at(u, v));
          worst = std::max(worst, off_m / (1e-4 + 2 * slope * std::max(1.0, coarse)));
        }
      EXPECT_EQ(holes, 0) << pair.name << " of " << seen << ", normal " << normal.transpose();
      EXPECT_LT(worst, 1) << pair.name << ", normal " << normal.transpose();
    }
}

// Coarse depth pixels reach from outside into the colour image.
TEST(DepthRegistration, TheBorderIsFilledWhereBothCamerasSee) {
  const CameraConfig colour = lens(320, 240, 300);
  const SE3 T_colour_depth = beside(0.02);
  const CameraConfig depth = lens(60, 45, 40);  // sees more than the colour camera
  const DepthImage got_m = DepthRegistration({depth, T_colour_depth}, colour)
                               .registered(plane_seen(depth, T_colour_depth, Vec3(0, 0, 1), 1.5));
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < 320; ++u) ASSERT_GT(got_m.at(u, v), 0) << u << " " << v;
}

TEST(DepthRegistration, NearerSurfaceHidesWhatTheDepthCameraSeesBehindIt) {
  const CameraConfig config = lens(160, 120, 140);
  const SE3 T_colour_depth = beside(0.1);
  DepthImage depth_m(160, 120, 3.0F);
  for (int v = 0; v < 120; ++v)
    for (int u = 60; u < 100; ++u) depth_m.at(u, v) = 1.0F;
  const DepthImage got_m = DepthRegistration({config, T_colour_depth}, config).registered(depth_m);
  // Seen from 10 cm to the left: the front moves by 14 px, the wall by 4.7 px.
  EXPECT_NEAR(got_m.at(80, 60), 0.998F, 1e-3);
  EXPECT_NEAR(got_m.at(110, 60), 0.998F, 1e-3);
  EXPECT_NEAR(got_m.at(120, 60), 2.998F, 1e-3);
  EXPECT_NEAR(got_m.at(60, 60), 2.998F, 1e-3);
  EXPECT_EQ(got_m.at(69, 60), 0) << "what only the colour camera sees has no depth";
}

TEST(DepthRegistration, OneCameraNeedsNone) {
  const CameraConfig config = lens(160, 120, 140);
  EXPECT_EQ(depth_registration({config, SE3()}, config), nullptr);
  EXPECT_NE(depth_registration({config, beside(0.01)}, config), nullptr);
  EXPECT_NE(depth_registration({lens(160, 120, 141), SE3()}, config), nullptr);
}

TEST(DepthRegistration, WhatLiesBehindTheColourCameraIsNotDrawn) {
  const CameraConfig config = lens(160, 120, 140);
  const SE3 T_colour_depth(so3_exp({0, 3.0, 0}), Vec3(0, 0, 0.5));
  const DepthImage got_m =
      DepthRegistration({config, T_colour_depth}, config).registered(DepthImage(160, 120, 2.0F));
  for (const float d : got_m) EXPECT_EQ(d, 0);
}

}  // namespace
}  // namespace ygslam
