#include "tracking/motion_model.hpp"

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
    EXPECT_LT(model.predict(at(10.03)).log().norm(), 1e-12) << "no velocity yet";
    model.update(at(10.04), SE3::exp(velocity * 0.04));
    for (const double dt_s : {0.02, 0.04, 0.2}) {
      const SE3 expected = SE3::exp(velocity * dt_s);
      EXPECT_LT((model.predict(at(10.04 + dt_s)) * expected.inverse()).log().norm(), 1e-9);
    }
  }
}

TEST(MotionModel, KnowsNothingAfterAGapOrAReset) {
  Vec6 velocity = Vec6::Constant(0.3);
  MotionModel model({});
  model.reset(at(1));
  model.update(at(1.03), SE3::exp(velocity * 0.03));
  EXPECT_LT(model.predict(at(2)).log().norm(), 1e-12) << "too long ago";
  EXPECT_LT(model.predict(at(1.03)).log().norm(), 1e-12) << "no time has passed";
  EXPECT_LT(model.predict(at(1.0)).log().norm(), 1e-12) << "backwards";
  model.update(at(2.0), SE3::exp(velocity));  // over a gap: says nothing about the velocity now
  EXPECT_LT(model.predict(at(2.03)).log().norm(), 1e-12);
  model.update(at(2.03), SE3::exp(velocity * 0.03));
  EXPECT_GT(model.predict(at(2.06)).log().norm(), 1e-3);
  model.reset(at(2.06));
  EXPECT_LT(model.predict(at(2.09)).log().norm(), 1e-12);
}

}  // namespace
}  // namespace ygslam
