#include "tracking/odometry.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

SE3 forward(double metres) { return {Mat3::Identity(), Vec3(0, 0, -metres)}; }  // T_now_last
SE3 at(double x_m, double z_m) { return {Mat3::Identity(), Vec3(x_m, 0, z_m)}; }

TEST(Odometry, CorrectionsMoveTheWorldAndNotTheCamera) {
  Odometry odometry;
  EXPECT_EQ(odometry.place(SE3(), true).correction_m, 0);
  odometry.move(forward(1));
  EXPECT_NEAR(odometry.place(at(0, 1), true).correction_m, 0, 1e-12);
  odometry.move(forward(1));
  const auto corrected = odometry.place(at(0.3, 2), true);
  EXPECT_NEAR(corrected.correction_m, 0.3, 1e-12);
  EXPECT_EQ(odometry.T_odom_camera().t(), Vec3(0, 0, 2));
  EXPECT_LT(((corrected.T_world_odom * odometry.T_odom_camera()).t() - Vec3(0.3, 0, 2)).norm(),
            1e-12);
  EXPECT_NEAR(odometry.place(at(0.3, 2), true).correction_m, 0, 1e-12);
}

TEST(Odometry, ADoubtfulPlaceIsProvisionalForEightMetres) {
  Odometry odometry;
  EXPECT_FALSE(odometry.place(SE3(), true).provisional);
  odometry.doubt();
  for (int metres = 1; metres <= 8; ++metres) {
    odometry.move(forward(1));
    EXPECT_TRUE(odometry.place(at(0, metres), true).provisional) << metres;
  }
  odometry.move(forward(1));
  EXPECT_TRUE(odometry.place(at(0, 9), false).provisional) << "what is new proves nothing";
  EXPECT_FALSE(odometry.place(at(0, 9), true).provisional);
  odometry.move(forward(-5));
  EXPECT_FALSE(odometry.place(at(0, 4), true).provisional) << "it was proved";
}

}  // namespace
}  // namespace ygslam
