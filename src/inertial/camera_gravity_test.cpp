#include "inertial/camera_gravity.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/statistics.hpp"
#include "inertial/estimator_test_world.hpp"

namespace ygslam {
namespace {

using inertial_world::Drive;

Vec3 true_down_camera(const Drive& drive) {
  return drive.true_pose().R().transpose() * drive.true_gravity_odom().normalized();
}

// Two degrees of freedom: 95 % lie below 5.99.
double squared_sigmas(const CameraGravity& found, const Vec3& down) {
  const Mat3 floor = 1e-12 * Mat3::Identity();
  const Vec3 error = found.down_camera - down;
  return error.dot((found.covariance + floor).ldlt().solve(error));
}

TEST(CameraGravity, IsKnownAsWellAsItIsSaid) {
  std::vector<double> error_rad, nees;
  for (std::uint64_t seed = 0; seed < inertial_world::kSeeds; ++seed) {
    Drive drive({.seed = seed});
    EXPECT_FALSE(drive.estimator().camera_gravity());
    drive.run(8);
    for (int i = 0; i < 3; ++i) {
      drive.run(3);
      const auto found = drive.estimator().camera_gravity();
      ASSERT_TRUE(found);
      EXPECT_EQ(found->stamp, drive.now());
      EXPECT_NEAR(found->down_camera.norm(), 1, 1e-12);
      error_rad.push_back((found->down_camera - true_down_camera(drive)).norm());
      // Along the direction itself nothing is said.
      EXPECT_LT(found->down_camera.dot(found->covariance * found->down_camera), 1e-9);
      Vec3 across = true_down_camera(drive);
      across -= found->down_camera * (found->down_camera.dot(across) - 1);
      nees.push_back(squared_sigmas(*found, across));
    }
  }
  EXPECT_LT(median(std::vector(error_rad)), 0.002);
  EXPECT_LT(std::ranges::max(error_rad), 0.008);
  const auto within = std::ranges::count_if(nees, [](double value) { return value < 5.99; });
  EXPECT_GE(static_cast<double>(within), 0.85 * static_cast<double>(nees.size()));
  EXPECT_GT(median(std::vector(nees)), 0.4) << "a smaller covariance would do, too";
}

}  // namespace
}  // namespace ygslam
