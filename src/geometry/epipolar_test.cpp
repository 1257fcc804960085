#include "geometry/epipolar.hpp"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/geometry_testing.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam {
namespace {

using geometry_test::random_pixel;
using geometry_test::test_camera;

SE3 random_motion(Rng& rng, double max_angle_rad, double distance_m) {
  const Vec3 omega = random_normals<3>(rng);
  const Vec3 direction = random_normals<3>(rng);
  return {so3_exp(omega.normalized() * max_angle_rad * rng.uniform()),
          direction.normalized() * distance_m};
}

enum class Scene { kDeep, kPlane };

/// Matches of static points between two views of a room, with Gaussian noise.
std::vector<PointPair> static_pairs(const Camera& camera, const SE3& T_2_1, int n, double noise_px,
                                    Rng& rng, Scene scene = Scene::kDeep) {
  std::vector<PointPair> pairs;
  while (static_cast<int>(pairs.size()) < n) {
    const Vec2 p1 = random_pixel(rng);
    const double depth_m = scene == Scene::kPlane ? 2.0 : rng.uniform(0.8, 5);
    const Vec3 p_cam2 = T_2_1 * camera.unproject(p1, depth_m);
    if (p_cam2.z() < 0.2) continue;
    PointPair pair{p1, camera.project(p_cam2)};
    pair.p1_px += noise_px * random_normals<2>(rng);
    pair.p2_px += noise_px * random_normals<2>(rng);
    pairs.push_back(pair);
  }
  return pairs;
}

PointPair random_pair(Rng& rng) {
  return {{rng.uniform(0, 639), rng.uniform(0, 479)}, {rng.uniform(0, 639), rng.uniform(0, 479)}};
}

/// Share of noise-free static points whose epipolar distance under F is below limit_px.
double share_within(const Mat3& F, const Camera& camera, const SE3& T_2_1, double limit_px,
                    Rng& rng, Scene scene = Scene::kDeep) {
  const auto pairs = static_pairs(camera, T_2_1, 500, 0, rng, scene);
  int good = 0;
  for (const PointPair& pair : pairs) good += epipolar_distance_px(F, pair) < limit_px ? 1 : 0;
  return good / 500.0;
}

TEST(FitFundamental, RecoversRandomCameras) {
  const Camera camera = test_camera();
  for (int seed = 0; seed < 50; ++seed) {
    Rng rng(static_cast<std::uint64_t>(seed));
    const SE3 T_2_1 = random_motion(rng, 0.3, 0.2);
    const auto pairs = static_pairs(camera, T_2_1, 15 + seed % 3 * 20, 0, rng);
    const auto fit = fit_fundamental(pairs, {}, rng);
    ASSERT_TRUE(fit);
    const Mat3 truth = fundamental_from_pose(camera, T_2_1);
    // Compared in pixels, on other points: entries of F differ by orders of magnitude.
    EXPECT_GT(share_within(fit->F, camera, T_2_1, 0.05, rng), 0.97) << "seed " << seed;
    EXPECT_NEAR(std::abs((fit->F.array() * truth.array()).sum()), 1.0, 1e-4) << "seed " << seed;
  }
}

TEST(FitFundamental, HasRankTwo) {
  const Camera camera = test_camera();
  Mat3 K;
  K << camera.fx(), 0, camera.cx(), 0, camera.fy(), camera.cy(), 0, 0, 1;
  Rng rng(5);
  for (int i = 0; i < 20; ++i) {
    const auto pairs = static_pairs(camera, random_motion(rng, 0.2, 0.1), 100, 0.5, rng);
    const auto fit = fit_fundamental(pairs, {}, rng);
    ASSERT_TRUE(fit);
    // Judged where the entries are of one size: on rays, not on pixels.
    const Eigen::JacobiSVD<Mat3> svd(K.transpose() * fit->F * K);
    EXPECT_LT(svd.singularValues()(2), 1e-9 * svd.singularValues()(0));
  }
}

TEST(Epipolar, WithoutALineTheDistanceIsInfinite) {
  EXPECT_TRUE(std::isinf(epipolar_distance_px(Mat3::Zero(), {})));
}

TEST(FitFundamental, SurvivesHalfOutliers) {
  const Camera camera = test_camera();
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Rng rng(seed);
    const SE3 T_2_1 = random_motion(rng, 0.1, 0.15);
    auto pairs = static_pairs(camera, T_2_1, 300, 0.3, rng);
    for (int i = 0; i < 250; ++i) pairs.push_back(random_pair(rng));
    RansacConfig config;
    config.max_iterations = 3000;
    const auto fit = fit_fundamental(pairs, config, rng);
    ASSERT_TRUE(fit);
    EXPECT_GT(fit->inliers, 270) << "seed " << seed;
    EXPECT_GT(share_within(fit->F, camera, T_2_1, 1.0, rng), 0.9) << "seed " << seed;
  }
}

TEST(FitFundamental, SameSeedSameFit) {
  Rng rng(3);
  const auto pairs = static_pairs(test_camera(), random_motion(rng, 0.1, 0.1), 200, 0.5, rng);
  Rng a(9);
  Rng b(9);
  const auto fit_a = fit_fundamental(pairs, {}, a);
  const auto fit_b = fit_fundamental(pairs, {}, b);
  ASSERT_TRUE(fit_a && fit_b);
  EXPECT_EQ(fit_a->F, fit_b->F);
  EXPECT_EQ(fit_a->inlier, fit_b->inlier);
}

TEST(FitFundamental, DegenerateScenesStillExplainTheStaticPoints) {
  const Camera camera = test_camera();
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    for (const double noise_px : {0.0, 0.2}) {
      Rng rng(seed);
      const SE3 rotation = random_motion(rng, 0.1, 0.0);
      const auto turned = static_pairs(camera, rotation, 200, noise_px, rng);
      const auto fit = fit_fundamental(turned, {}, rng);
      ASSERT_TRUE(fit);
      EXPECT_TRUE(fit->F.allFinite());
      EXPECT_GT(fit->inliers, 190);
      const SE3 shift = random_motion(rng, 0.05, 0.1);
      const auto flat = static_pairs(camera, shift, 200, noise_px, rng, Scene::kPlane);
      const auto flat_fit = fit_fundamental(flat, {}, rng);
      ASSERT_TRUE(flat_fit);
      EXPECT_GT(flat_fit->inliers, 190);
    }
  }
}

TEST(FitFundamental, BadInputGivesNothing) {
  Rng rng(4);
  const Camera camera = test_camera();
  const auto pairs = static_pairs(camera, random_motion(rng, 0.1, 0.2), 14, 0, rng);
  EXPECT_FALSE(fit_fundamental(pairs, {}, rng));  // below min_inliers
  EXPECT_FALSE(fit_fundamental({}, {}, rng));
  const std::vector<PointPair> same(100, PointPair{{10, 10}, {12, 10}});
  EXPECT_FALSE(fit_fundamental(same, {}, rng));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<PointPair> broken(100, PointPair{{nan, 1}, {1, nan}});
  EXPECT_FALSE(fit_fundamental(broken, {}, rng));
}

TEST(FitFundamental, ResultsAreFiniteForRepeatedAndCollinearPoints) {
  Rng rng(4);
  std::vector<PointPair> line;
  for (int i = 0; i < 100; ++i) line.push_back({{1.0 * i, 2.0 * i}, {1.0 * i + 3, 2.0 * i}});
  if (const auto fit = fit_fundamental(line, {}, rng)) {
    EXPECT_TRUE(fit->F.allFinite());
  }
  std::vector<PointPair> few(100, PointPair{{5, 5}, {6, 5}});
  for (int i = 0; i < 6; ++i) few[i] = random_pair(rng);
  if (const auto fit = fit_fundamental(few, {}, rng)) {
    EXPECT_TRUE(fit->F.allFinite());
  }
}

TEST(FitFundamental, NotFinitePairsAreOutliers) {
  const Camera camera = test_camera();
  Rng rng(11);
  const SE3 T_2_1 = random_motion(rng, 0.1, 0.15);
  auto pairs = static_pairs(camera, T_2_1, 100, 0.1, rng);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 10; ++i) pairs.insert(pairs.begin() + 7 * i, PointPair{{nan, 0}, {0, 0}});
  const auto fit = fit_fundamental(pairs, {}, rng);
  ASSERT_TRUE(fit);
  ASSERT_EQ(fit->inlier.size(), pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (pairs[i].p1_px.allFinite()) continue;
    EXPECT_EQ(fit->inlier[i], 0);
  }
  EXPECT_GT(fit->inliers, 95);
}

TEST(Ransac, IterationsGrowWithOutliersAndStayBounded) {
  EXPECT_EQ(ransac_iterations(1.0, 8, 0.99, 500), 1);
  EXPECT_EQ(ransac_iterations(0.0, 8, 0.99, 500), 500);
  int before = 0;
  for (double share = 1.0; share > 0.05; share -= 0.05) {
    const int n = ransac_iterations(share, 8, 0.99, 500);
    EXPECT_GE(n, before);
    EXPECT_LE(n, 500);
    before = n;
  }
}

TEST(Ransac, SamplesHoldDifferentIndices) {
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    auto sample = draw_sample<8>(8, rng);
    std::sort(sample.begin(), sample.end());
    for (std::uint32_t k = 0; k < 8; ++k) EXPECT_EQ(sample[k], k);
  }
}

}  // namespace
}  // namespace ygslam
