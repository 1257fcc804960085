#include "geometry/camera.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam {
namespace {

CameraConfig freiburg1() {
  CameraConfig c;
  c.fx = 517.3, c.fy = 516.5, c.cx = 318.6, c.cy = 255.3;
  c.k1 = 0.2624, c.k2 = -0.9531, c.p1 = -0.0054, c.p2 = 0.0026, c.k3 = 1.1633;
  return c;
}

TEST(Camera, DistortInvertsUndistortBetweenPixelCentres) {
  const Camera camera(freiburg1());
  Rng rng(2);
  for (int i = 0; i < 1000; ++i) {
    const Vec2 px = random_in_box<2>(rng, {0, 0}, {638, 478});
    EXPECT_LT((camera.distort(camera.undistort(px)) - px).norm(), 2e-3);
  }
}

// Strong lenses, on which an iteration that trusts its steps runs away.
TEST(Camera, WholePixelsUndistortToTheSameBits) {
  CameraConfig config;
  for (const double k1 : {0.0, 0.2624}) {
    config.k1 = k1;
    config.k2 = -k1 * 3.6;
    const Camera camera(config);
    for (int v = 0; v < camera.height(); ++v)
      for (int u = 0; u < camera.width(); ++u)
        ASSERT_EQ(camera.undistort_pixel(u, v), camera.undistort({u, v})) << u << " " << v;
  }
}

TEST(Camera, EveryPixelOfAStrongButPossibleLensHasItsRay) {
  const auto with = [](double k1, double k2, double k3, double p1) {
    CameraConfig c = freiburg1();
    c.k1 = k1, c.k2 = k2, c.k3 = k3, c.p1 = p1, c.p2 = 0;
    return c;
  };
  CameraConfig off_centre = freiburg1();
  off_centre.cx = 0;
  for (const CameraConfig& config : {freiburg1(), off_centre, with(9, 0, 0, 0), with(0, 90, 0, 0),
                                     with(0, 0, 900, 0), with(-0.4, 0.3, 0, 0), with(5, 20, 100, 0),
                                     with(0, 0, 0, 0.05), with(-0.17, 0, 0, 0.001)}) {
    ASSERT_EQ(pixel_without_ray(config), std::nullopt) << config.k1 << " " << config.k2;
    const Camera camera(config);
    for (int v = 0; v < 480; v += 7) {
      for (int u = 0; u < 640; u += 7) {
        const Vec2 px(u, v);
        ASSERT_LT((camera.distort(camera.undistort(px)) - px).norm(), 1e-2) << px.transpose();
      }
    }
    const auto& b = camera.ideal_bounds();
    EXPECT_LT(b[2] - b[0], 2000);
    EXPECT_LT(b[3] - b[1], 2000);
  }
}

TEST(Camera, ALensThatFoldsTheImageHasAPixelWithoutRay) {
  CameraConfig k3_forgotten = freiburg1();
  k3_forgotten.k3 = 0;
  CameraConfig barrel = freiburg1();
  barrel.k1 = -1, barrel.k2 = barrel.k3 = 0;
  CameraConfig tangential = freiburg1();
  tangential.p1 = -1;
  for (const CameraConfig& config : {k3_forgotten, barrel, tangential}) {
    EXPECT_NE(pixel_without_ray(config), std::nullopt) << config.k1;
    const Camera camera(config);  // odd, but no harm
    const auto& b = camera.ideal_bounds();
    EXPECT_TRUE(std::isfinite(b[0] + b[1] + b[2] + b[3]));
  }
}

TEST(Camera, WithoutDistortionIdealIsRecorded) {
  CameraConfig c = freiburg1();
  c.k1 = c.k2 = c.p1 = c.p2 = c.k3 = 0;
  const Camera camera(c);
  EXPECT_EQ(camera.undistort({12.5, 30.25}), Vec2(12.5, 30.25));
}

}  // namespace
}  // namespace ygslam
