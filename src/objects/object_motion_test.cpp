#include "objects/object_motion.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam {
namespace {

constexpr double kFrame_s = 1.0 / 30;

MotionFilter after_a_walk(const Vec3& velocity_mps, int frames) {
  MotionFilter filter;
  for (int k = 0; k < frames; ++k) {
    filter.predict(kFrame_s, false);
    filter.update(k * kFrame_s * velocity_mps);
    filter.update_velocity(velocity_mps);
  }
  return filter;
}

TEST(ObjectMotion, ForecastsThatWhoWalksGoesOnButNotForEver) {
  const ObjectMotion now = after_a_walk({0.8, 0, -0.6}, 60).motion();
  EXPECT_LT((now.velocity_mps - Vec3(0.8, 0, -0.6)).norm(), 0.01);
  const ObjectMotion soon = now.after(1), late = now.after(10);
  EXPECT_GT((soon.position_m - now.position_m).norm(), 0.7);
  EXPECT_LT((soon.position_m - now.position_m).norm(), 1.0);
  EXPECT_LT((late.position_m - now.position_m).norm(), 2.5);
  EXPECT_LT(late.velocity_mps.norm(), 0.05);
}

TEST(ObjectMotion, AForecastIsSurerOfWhoStandsAndAcrossTheWay) {
  const Mat6 stands = after_a_walk({0, 0, 0}, 60).motion().after(1).covariance;
  const Mat6 walks = after_a_walk({1, 0, 0}, 60).motion().after(1).covariance;
  EXPECT_GT(walks(0, 0), 2 * stands(0, 0));
  EXPECT_NEAR(walks(1, 1), stands(1, 1), 1e-9);
}

TEST(ObjectMotion, ADoubledStepIsTwoSteps) {
  const ObjectMotion now = after_a_walk({1, 0, 0}, 40).motion();
  const ObjectMotion once = now.after(1), twice = now.after(0.5).after(0.5);
  EXPECT_LT((once.position_m - twice.position_m).norm(), 1e-9);
  EXPECT_LT((once.velocity_mps - twice.velocity_mps).norm(), 1e-9);
}

TEST(ObjectMotion, IsTheSameInAnyFrame) {
  const SE3 T(so3_exp(Vec3(0.3, -1.2, 0.5)), Vec3(4, -2, 1));
  const ObjectMotion now = after_a_walk({0.5, 0.2, 1}, 40).motion();
  const ObjectMotion a = now.after(1.3).seen_from(T), b = now.seen_from(T).after(1.3);
  EXPECT_LT((a.position_m - b.position_m).norm(), 1e-9);
  EXPECT_LT((a.covariance - b.covariance).norm(), 1e-9);
}

TEST(ObjectMotion, CovarianceGrowsWhileNobodySeesIt) {
  MotionFilter filter = after_a_walk({1, 0, 0}, 60);
  double before = filter.motion().covariance.topLeftCorner<3, 3>().trace();
  for (int s = 0; s < 5; ++s) {
    for (int k = 0; k < 30; ++k) filter.predict(kFrame_s, true);
    const double now = filter.motion().covariance.topLeftCorner<3, 3>().trace();
    EXPECT_GT(now, 1.2 * before);
    before = now;
  }
  EXPECT_LT(filter.motion().position_m.x(), 2 + 1.2);  // it does not walk through the wall
}

TEST(ObjectMotion, AWrongMeasurementMovesItLittle) {
  MotionFilter filter = after_a_walk({0, 0, 0}, 60);
  filter.update({1.5, 0, 0});
  EXPECT_LT(filter.motion().position_m.norm(), 0.15);
}

TEST(ObjectMotion, CovarianceIsTrueOfWhoMovesAsItAssumes) {
  // Errors over their covariance: as many as there are dimensions, on average.
  Rng rng(3);
  const auto vector = [&](double sigma) -> Vec3 { return random_normals<3>(rng) * sigma; };
  double nees = 0;
  constexpr int kPeople = 400;
  for (int person = 0; person < kPeople; ++person) {
    MotionFilter filter;
    Vec3 p = Vec3::Zero(), v = vector(0.7);
    const Vec3 side = vector(0.08);
    for (int k = 0; k < 45; ++k) {
      v += vector(0.8 * std::sqrt(kFrame_s));
      p += kFrame_s * v;
      filter.predict(kFrame_s, false);
      filter.update(p + side + vector(0.07));
    }
    const Vec3 e = filter.motion().position_m - p;
    nees += e.dot(filter.motion().covariance.topLeftCorner<3, 3>().ldlt().solve(e)) / kPeople;
  }
  EXPECT_NEAR(nees, 3, 0.6);
}

}  // namespace
}  // namespace ygslam
