#include "geometry/motion_model.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"

namespace ygslam {
namespace {

Timestamp at(double seconds) { return {to_ns(seconds)}; }

TEST(MotionModel, ConstantVelocityIsPredictedExactlyOverAnyStep) {
  Rng rng(1);
  for (int trial = 0; trial < 50; ++trial) {
    Vec6 velocity;
    for (int i = 0; i < 6; ++i) velocity[i] = rng.normal(0, 0.5);
    MotionModel model({});
    model.reset(at(10));
    EXPECT_LT(model.predict(at(10.03)).T_now_last.log().norm(), 1e-12) << "no velocity yet";
    model.update(at(10.04), SE3::exp(velocity * 0.04));
    for (const double dt_s : {0.02, 0.04, 0.2}) {
      const SE3 expected = SE3::exp(velocity * dt_s);
      EXPECT_LT((model.predict(at(10.04 + dt_s)).T_now_last * expected.inverse()).log().norm(),
                1e-9);
    }
  }
}

TEST(MotionModel, VelocityGoesHalfTheWayFromAStepsMeanToItsEnd) {
  const Vec6 axis = (Vec6() << 0.3, -0.2, 0.1, 0.6, -0.4, 0.2).finished();
  // The twist since t = 0 grows as t + 2 t^2 along one axis: the velocity is 1 + 4 t.
  const auto step = [&](double from_s, double to_s) {
    const auto grown = [](double t_s) { return t_s + 2 * t_s * t_s; };
    return SE3::exp(-(grown(to_s) - grown(from_s)) * axis);
  };
  MotionModel model({});
  model.reset(at(0));
  EXPECT_LT((model.body_velocity(at(0.03), step(0, 0.03)) - 1.06 * axis).norm(), 1e-9)
      << "one step alone tells its mean";
  model.update(at(0.03), step(0, 0.03));
  // 1.22 in the middle, 1.32 at the end.
  EXPECT_LT((model.body_velocity(at(0.08), step(0.03, 0.08)) - 1.27 * axis).norm(), 1e-9);
  EXPECT_LT(model.body_velocity(at(3), step(0.03, 0.08)).norm(), 1e-12) << "too long ago";
}

TEST(MotionModel, VelocityFollowsTheStepByItsGain) {
  MotionModel model({});
  model.reset(at(1));
  for (const double now_s : {1.03, 1.05}) {
    const Vec6 twist = Vec6::Constant(0.02);
    const Vec6 change = (Vec6() << 1, 2, 3, 4, 5, 6).finished() * 1e-3;
    const Vec6 slower = model.body_velocity(at(now_s), SE3::exp(twist));
    const Vec6 faster = model.body_velocity(at(now_s), SE3::exp(twist - change));
    EXPECT_LT((faster - slower - model.predict(at(now_s)).velocity_gain_per_s * change).norm(),
              1e-9);
    model.update(at(now_s), SE3::exp(twist));
  }
}

TEST(MotionModel, KnowsNothingAfterAGapOrAReset) {
  Vec6 velocity = Vec6::Constant(0.3);
  MotionModel model({});
  model.reset(at(1));
  model.update(at(1.03), SE3::exp(velocity * 0.03));
  EXPECT_LT(model.predict(at(2)).T_now_last.log().norm(), 1e-12) << "too long ago";
  EXPECT_LT(model.predict(at(1.03)).T_now_last.log().norm(), 1e-12) << "no time has passed";
  EXPECT_LT(model.predict(at(1.0)).T_now_last.log().norm(), 1e-12) << "backwards";
  model.update(at(2.0), SE3::exp(velocity));  // over a gap: says nothing about the velocity now
  EXPECT_LT(model.predict(at(2.03)).T_now_last.log().norm(), 1e-12);
  model.update(at(2.03), SE3::exp(velocity * 0.03));
  EXPECT_GT(model.predict(at(2.06)).T_now_last.log().norm(), 1e-3);
  model.reset(at(2.06));
  EXPECT_LT(model.predict(at(2.09)).T_now_last.log().norm(), 1e-12);
}

}  // namespace
}  // namespace ygslam
