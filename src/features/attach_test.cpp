#include "features/attach.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"
#include "geometry/geometry_testing.hpp"

namespace ygslam {
namespace {

CameraConfig kinect() {
  CameraConfig camera = geometry_test::test_camera().config();
  camera.colour_readout_ms = 26;
  camera.depth_readout_ms = 26;
  return camera;
}

Vec6 fast() {
  Vec6 velocity;
  velocity << 0.2, -0.3, 0.25, 0.8, -0.6, 0.9;
  return velocity;
}

/// A wall, seen from a camera that moves while its rows are read.
struct Wall {
  Vec3 normal = Vec3(0.2, -0.3, 1).normalized();  // in the camera of the middle instant
  double distance_m = 2;

  /// The wall's point on a ray of the camera at time t_s, in that camera.
  [[nodiscard]] Vec3 seen(const Camera& camera, const Vec2& ideal_px, const Vec6& velocity,
                          double t_s) const {
    const SE3 T_middle_then = SE3::exp(t_s * velocity);
    const Vec3 ray = camera.unproject(ideal_px, 1.0);
    const double depth_m =
        (distance_m - normal.dot(T_middle_then.t())) / normal.dot(T_middle_then.R() * ray);
    return depth_m * ray;
  }
};

DepthImage depth_of(const Wall& wall, const Camera& camera, const Vec6& velocity) {
  const RollingShutter shutter(camera.height(), {shutter_times(camera.config()), velocity});
  DepthImage depth_m(camera.width(), camera.height());
  for (int v = 0; v < camera.height(); ++v)
    for (int u = 0; u < camera.width(); ++u)
      depth_m.at(u, v) =
          static_cast<float>(wall.seen(camera, Vec2(u, v), velocity, shutter.depth_time_s(v)).z());
  return depth_m;
}

/// Largest error [m] of features that are brought to the middle instant.
double worst_error_m(const CameraConfig& config) {
  const Camera camera(config);
  const Wall wall;
  const ReadOut read_out{shutter_times(config), fast()};
  const RollingShutter shutter(camera.height(), read_out);
  const DepthImage depth_m = depth_of(wall, camera, fast());
  Rng rng(5);
  Features features;
  features.points.resize(300);
  features.descriptors.resize(300);
  for (Feature& f : features.points)
    f.uv_px = {static_cast<float>(rng.uniform(20, 620)), static_cast<float>(rng.uniform(20, 460))};
  attach_geometry(features, camera, depth_m, PyramidScales(1, 1.2));
  move_to_middle_instant(features, camera, depth_m, read_out);
  double worst_m = 0;
  for (const Feature& f : features.points) {
    const double t_s = shutter.colour_time_s(f.uv_px.y());
    const Vec3 p_row = wall.seen(camera, f.uv_px.cast<double>(), fast(), t_s);
    const Vec3 truth = shutter.to_middle(p_row, f.uv_px.y());
    const Vec3 p_middle = camera.unproject(f.ideal_px.cast<double>(), f.depth_m);
    worst_m = std::max(worst_m, (p_middle - truth).norm());
  }
  return worst_m;
}

TEST(MoveToMiddleInstant, FeaturesOfAWallLieWhereTheMiddleInstantHasThem) {
  EXPECT_LT(worst_error_m(kinect()), 0.003);  // depths are those of whole pixels
}

TEST(MoveToOtherTimes, GivesWhatTheseTimesHadGivenAtOnce) {
  const Camera camera(kinect());
  const ReadOut was{{0.01, 0.01, 0}, fast()};
  const ReadOut now{shutter_times(camera.config()), fast()};
  const DepthImage wall_m(camera.width(), camera.height(), 2.5F);
  Features features;
  for (const float v : {5.F, 120.F, 300.F, 470.F}) {
    Feature feature;
    feature.uv_px = {1.3F * v, v};
    features.points.push_back(feature);
  }
  features.descriptors.resize(features.size());
  for (const DepthImage& depth_m : {wall_m, DepthImage()}) {
    Features late = features, at_once = features;
    move_to_middle_instant(late, camera, depth_m, was);
    move_to_middle_instant(at_once, camera, depth_m, now);
    const float before_px = (late.points[0].ideal_px - at_once.points[0].ideal_px).norm();
    EXPECT_GT(before_px, 1);
    move_to_other_times(late, camera, was, now);
    for (std::size_t i = 0; i < features.size(); ++i) {
      EXPECT_LT((late.points[i].ideal_px - at_once.points[i].ideal_px).norm(), 0.01) << i;
      EXPECT_NEAR(late.points[i].depth_m, at_once.points[i].depth_m, 1e-4) << i;
    }
  }
}

TEST(MoveToMiddleInstant, DepthMayHaveTimesOfItsOwn) {
  CameraConfig camera = kinect();
  camera.depth_readout_ms = 34;
  camera.depth_delay_ms = -12;
  EXPECT_LT(worst_error_m(camera), 0.004);
  camera.depth_readout_ms = -30;
  EXPECT_LT(worst_error_m(camera), 0.004);
}

TEST(MoveToMiddleInstant, WithoutDepthTheRotationIsUndone) {
  const Camera camera(kinect());
  Vec6 turning = fast();
  turning.head<3>().setZero();
  const ReadOut read_out{shutter_times(kinect()), turning};
  const RollingShutter shutter(camera.height(), read_out);
  Features features;
  features.points.resize(1);
  features.points[0].uv_px = {100, 30};
  move_to_middle_instant(features, camera, {}, read_out);
  const Vec3 ray = shutter.to_middle(camera.unproject(Vec2(100, 30), 1), 30);
  EXPECT_LT((features.points[0].ideal_px.cast<double>() - camera.project(ray)).norm(), 1e-3);
  EXPECT_EQ(features.points[0].depth_m, 0);
}

TEST(MoveToMiddleInstant, TwiceIsOnceAndAGlobalShutterIsLeftAlone) {
  CameraConfig config = kinect();
  Features once;
  once.points.resize(1);
  once.points[0].uv_px = {400, 440};
  const DepthImage depth_m(640, 480, 1.5F);
  attach_geometry(once, Camera(config), depth_m, PyramidScales(1, 1.2));
  const Feature seen = once.points[0];
  move_to_middle_instant(once, Camera(config), depth_m, {shutter_times(config), fast()});
  Features twice = once;
  move_to_middle_instant(twice, Camera(config), depth_m, {shutter_times(config), fast()});
  EXPECT_EQ(once.points[0].ideal_px, twice.points[0].ideal_px);
  EXPECT_EQ(once.points[0].depth_m, twice.points[0].depth_m);
  EXPECT_GT((once.points[0].ideal_px - seen.ideal_px).norm(), 1);
  move_to_middle_instant(once, Camera(config), depth_m, {shutter_times(config), Vec6::Zero()});
  EXPECT_EQ(once.points[0].ideal_px, seen.ideal_px) << "taken back";
  EXPECT_EQ(once.points[0].depth_m, seen.depth_m);
  config.colour_readout_ms = config.depth_readout_ms = 0;
  Features global;
  global.points = {seen};
  move_to_middle_instant(global, Camera(config), depth_m, {shutter_times(config), fast()});
  EXPECT_EQ(global.points[0].ideal_px, seen.ideal_px);
}

}  // namespace
}  // namespace ygslam
