#include "optim/residual.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "optim/synthetic_views.hpp"

namespace ygslam {
namespace {

Eigen::Matrix3Xd numeric_jacobian(const std::function<Vec3(const Eigen::VectorXd&)>& f, int size) {
  Eigen::Matrix3Xd J(3, size);
  for (int i = 0; i < size; ++i) {
    Eigen::VectorXd h = Eigen::VectorXd::Zero(size);
    h[i] = 1e-6;
    J.col(i) = (f(h) - f(-h)) / 2e-6;
  }
  return J;
}

struct View {
  Camera camera = synthetic::camera();
  SE3 T_camera_world;
  Vec3 p_world;
  Observation seen;
};

View random_view(Rng& rng) {
  View v;
  v.T_camera_world = SE3::exp(synthetic::random_twist(rng, 1, 0.7));
  v.p_world = synthetic::random_point(v.camera, v.T_camera_world, rng);
  synthetic::Noise noise;
  noise.pixel_px = rng.uniform(0.5, 3);
  noise.without_depth_share = 0.3;
  v.seen = synthetic::observe(v.camera, v.T_camera_world, v.p_world, noise, rng);
  return v;
}

TEST(Residual, IsTheStatedOneDividedByItsDeviation) {
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    const View v = random_view(rng);
    const Vec3 p_cam = v.T_camera_world * v.p_world;
    const Vec3 r = residual_vector(v.camera, v.seen, p_cam);
    const Vec2 pixel = (v.camera.project(p_cam) - v.seen.ideal_px) / v.seen.sigma_px;
    EXPECT_LT((r.head<2>() - pixel).norm(), 1e-10);
    const double d = v.seen.depth_m;
    const double depth = d > 0 ? (1 / p_cam.z() - 1 / d) / (v.seen.sigma_depth_m / (d * d)) : 0.0;
    EXPECT_NEAR(r[2], depth, 1e-9);
  }
}

TEST(Residual, JacobiansMatchFiniteDifferences) {
  Rng rng(2);
  for (int i = 0; i < 200; ++i) {
    const View v = random_view(rng);
    const auto of_pose = [&](const Eigen::VectorXd& xi) {
      return residual_vector(v.camera, v.seen, SE3::exp(Vec6(xi)) * v.T_camera_world * v.p_world);
    };
    const auto of_point = [&](const Eigen::VectorXd& d) {
      return residual_vector(v.camera, v.seen, v.T_camera_world * (v.p_world + Vec3(d)));
    };
    const Mat36 J_pose = pose_jacobian(v.camera, v.seen, v.T_camera_world * v.p_world);
    const Mat3 J_point = point_jacobian(v.camera, v.seen, v.T_camera_world, v.p_world);
    EXPECT_LT((J_pose - numeric_jacobian(of_pose, 6)).norm(), 1e-6 * (1 + J_pose.norm()));
    EXPECT_LT((J_point - numeric_jacobian(of_point, 3)).norm(), 1e-6 * (1 + J_point.norm()));
  }
}

TEST(Residual, NormalEquationsAreThoseOfTheWeightedJacobian) {
  Rng rng(3);
  for (int i = 0; i < 200; ++i) {
    const View v = random_view(rng);
    const Vec3 p = v.T_camera_world * v.p_world;
    const auto r = residual_at(whiten(v.camera, v.seen), p.x(), p.y(), p.z());
    const ResidualKernels kernels = {{rng.uniform(0.3, 3)}, {rng.uniform(0.3, 3)}};
    const double use_pixel = rng.uniform(), use_depth = rng.uniform();
    const auto n = camera_normal(r, use_pixel, use_depth, kernels);
    const Mat3 J = camera_jacobian(v.camera, v.seen, p);
    const Vec3 e = residual_vector(v.camera, v.seen, p);
    const double wp = use_pixel * kernels.pixel.weight(r.chi2_pixel());
    const double wd = use_depth * kernels.depth.weight(r.chi2_depth());
    const Mat3 W = Vec3(wp, wp, wd).asDiagonal();
    Mat3 A;
    A << n.a00, 0, n.a02, 0, n.a11, n.a12, n.a02, n.a12, n.a22;
    EXPECT_LT((A - J.transpose() * W * J).norm(), 1e-10 * A.norm());
    EXPECT_LT((Vec3(n.b0, n.b1, n.b2) - J.transpose() * W * e).norm(),
              1e-9 * (1 + e.norm() * J.norm()));
  }
}

TEST(Residual, FourLanesEqualFourTimesOne) {
  Rng rng(4);
  const View v = random_view(rng);
  const WhitenedObservation<double> o = whiten(v.camera, v.seen);
  const auto all = [](double value) { return Lanes(Lanes::Constant(value)); };
  const WhitenedObservation<Lanes> o4 = {
      all(o.x), all(o.y), all(o.scale_x), all(o.scale_y), all(o.inverse_depth), all(o.scale_depth)};
  const Lanes x(0.1, -0.2, 0.3, 0.4), y(0.3, 0.1, -0.4, 0.2), z(2.0, -1.0, 0.005, 0.7);
  const auto r4 = residual_at(o4, x, y, z);
  for (const ResidualKernels& kernels :
       {ResidualKernels{{2.4}, {1.9}}, ResidualKernels{{.tail_dof = 3.0}, {.tail_dof = 1.0}}}) {
    const auto n4 = camera_normal(r4, all(0.7), all(0.4), kernels);
    for (int k = 0; k < 4; ++k) {
      const auto r = residual_at(o, x[k], y[k], z[k]);
      EXPECT_EQ(r4.seen[k], z[k] > kNearestDepth_m ? 1.0 : 0.0);
      EXPECT_EQ(r.seen, r4.seen[k]);
      const auto n = camera_normal(r, 0.7, 0.4, kernels);
      EXPECT_NEAR(n4.cost[k], n.cost, 1e-9 * n.cost);
      EXPECT_NEAR(n4.a22[k], n.a22, 1e-9 * std::abs(n.a22));
      EXPECT_NEAR(n4.b2[k], n.b2, 1e-9 * std::abs(n.b2));
    }
  }
}

TEST(Cauchy, IsTheLikelihoodOfStudentsTAndSmooth) {
  constexpr double kDof = 3;
  const RobustKernel kernel{.tail_dof = kDof};
  for (const double s : {0.0, 0.3, 2.2, 50.0, 1e6}) {
    // Two coordinates: density (1 + s / dof)^(-(dof + 2) / 2).
    const double minus_log_density = 0.5 * (kDof + 2) * std::log1p(s / kDof);
    EXPECT_NEAR(0.5 * kernel.rho(s) * (kDof + 2) / kDof, minus_log_density,
                1e-12 * (1 + minus_log_density));
    EXPECT_NEAR(kernel.weight(s), (kernel.rho(s + 1e-6) - kernel.rho(s - 1e-6)) / 2e-6, 1e-6);
  }
}

TEST(Huber, IsQuadraticInsideLinearOutsideAndSmooth) {
  const RobustKernel kernel{1.5};
  EXPECT_DOUBLE_EQ(kernel.rho(1.0), 1.0);
  EXPECT_DOUBLE_EQ(kernel.rho(100.0), 2 * 1.5 * 10 - 1.5 * 1.5);
  for (const double s : {0.3, 2.2, 2.3, 50.0}) {
    EXPECT_NEAR(kernel.weight(s), (kernel.rho(s + 1e-6) - kernel.rho(s - 1e-6)) / 2e-6, 1e-6);
  }
  const RobustKernel off;
  for (const double s : {0.0, 1.0, 1e6}) {
    EXPECT_DOUBLE_EQ(off.rho(s), s);
    EXPECT_DOUBLE_EQ(off.weight(s), 1.0);
  }
}

TEST(Residual, UnfitObservationsAreRecognised) {
  Observation good;
  EXPECT_TRUE(is_usable(good));
  const double nan = std::nan(""), inf = HUGE_VAL;
  for (const double bad : {nan, inf, -inf}) {
    Observation o;
    o.ideal_px.x() = bad;
    EXPECT_FALSE(is_usable(o));
    o = {};
    o.depth_m = bad;
    EXPECT_FALSE(is_usable(o));
    o = {};
    o.sigma_px = bad;
    EXPECT_FALSE(is_usable(o));
    o = {};
    o.weight = bad;
    EXPECT_FALSE(is_usable(o));
  }
  good.sigma_px = 0;
  EXPECT_FALSE(is_usable(good));
}

}  // namespace
}  // namespace ygslam
