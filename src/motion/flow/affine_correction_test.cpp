#include "motion/flow/affine_correction.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <vector>

#include "core/rng.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam {
namespace {

struct Case {
  std::vector<Eigen::Vector2f> guess, found;
};

/// 60 points under an affine map with noise; every third moves on its own.
Case mixed(const Eigen::Matrix<float, 2, 3>& map, Rng& rng) {
  Case c;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector2f p = random_in_box<2>(rng, {0, 0}, {640, 480}).cast<float>();
    Eigen::Vector2f q = map * p.homogeneous();
    q += random_normals<2>(rng, 0.1).cast<float>();
    if (i % 3 == 0) q += Eigen::Vector2f(12, -7);
    c.guess.push_back(p);
    c.found.push_back(q);
  }
  return c;
}

TEST(AffineCorrection, FindsTheMotionOfTheMajority) {
  Rng rng(2);
  Eigen::Matrix<float, 2, 3> map;
  map << 1.002F, -0.012F, 5.5F, 0.012F, 0.998F, -8.0F;
  const Case c = mixed(map, rng);
  const auto fit = fit_affine_correction(c.guess, c.found);
  ASSERT_TRUE(fit);
  EXPECT_LT(fit->error_px, 0.3F);
  for (const Eigen::Vector2f& p : c.guess)
    EXPECT_LT(((*fit)(p)-map * p.homogeneous()).norm(), 0.3F);
}

TEST(AffineCorrection, SaysHowFarPointsScatter) {
  Rng rng(4);
  Case c;
  for (int i = 0; i < 60; ++i) {
    c.guess.emplace_back(random_in_box<2>(rng, {0, 0}, {640, 480}).cast<float>());
    const Eigen::Vector2f off = random_in_box<2>(rng, {-30, -30}, {30, 30}).cast<float>();
    c.found.push_back(c.guess.back() + off);
  }
  const auto fit = fit_affine_correction(c.guess, c.found);
  ASSERT_TRUE(fit);
  EXPECT_GT(fit->error_px, 5.0F);
}

TEST(AffineCorrection, RefusesTooFewPointsAndPointsOnALine) {
  std::vector<Eigen::Vector2f> few(11, Eigen::Vector2f(3, 4));
  EXPECT_FALSE(fit_affine_correction(few, few));
  EXPECT_FALSE(fit_affine_correction({}, {}));
  std::vector<Eigen::Vector2f> line;
  for (int i = 0; i < 40; ++i)
    line.emplace_back(static_cast<float>(10 * i), static_cast<float>(5 * i));
  EXPECT_FALSE(fit_affine_correction(line, line));
}

}  // namespace
}  // namespace ygslam
