#include "scene/floor_frame.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam {
namespace {

TEST(FloorFrame, OfALevelWorldIsTheWorldLiftedToTheFloor) {
  const SE3 T = T_world_floor({Vec3(0, 0, 1), 0.3});
  EXPECT_TRUE(T.R().isIdentity(1e-15));
  EXPECT_EQ(T.t(), Vec3(0, 0, 0.3));
}

TEST(FloorFrame, StandsUprightWhereverUpIs) {
  Rng rng(3);
  for (int i = 0; i < 1000; ++i) {
    Vec3 up = Vec3::Unit(i % 3);
    if (i >= 3) up << random_normals<2>(rng), -1;
    const double floor_m = rng.normal(0, 1);
    const SE3 T = T_world_floor({up, floor_m});
    ASSERT_TRUE((T.R().transpose() * T.R()).isIdentity(1e-12));
    ASSERT_NEAR(T.R().determinant(), 1, 1e-12);
    ASSERT_NEAR((T.R() * Vec3::UnitZ()).dot(up.normalized()), 1, 1e-12);
    ASSERT_NEAR(T.t().dot(up.normalized()), floor_m, 1e-12);
    ASSERT_NEAR(T.t().cross(up).norm(), 0, 1e-9) << "below the world's origin";
  }
}

TEST(FloorFrame, YawIsTheTurnAboutUp) {
  const Gravity gravity{Vec3(0.1, -1, 0.05), 1.2};
  const SE3 T_world = T_world_floor(gravity);
  for (const double yaw : {-3.0, -0.4, 0.0, 1.1, 3.1}) {
    const SE3 T_floor_box(so3_exp(Vec3(0, 0, yaw)), Vec3(1, 2, 0.5));
    EXPECT_NEAR(box_yaw({T_world * T_floor_box, Vec3(1, 1, 1)}, gravity), yaw, 1e-12);
  }
}

}  // namespace
}  // namespace ygslam
