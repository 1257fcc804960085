#include "inertial/time_offset.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "geometry/properties_testing.hpp"
#include "inertial/inertial_test_world.hpp"

namespace ygslam {
namespace {

using inertial_world::normal_vector;
using inertial_world::SmoothMotion;

struct Recording {
  std::vector<SeenTurn> turns;
  std::deque<ImuSample> samples;
};

Recording recorded(double offset_s, double liveliness, std::uint64_t seed, double noise_rad,
                   double around_s = 0.1) {
  const SmoothMotion motion(seed, liveliness);
  Rng rng(seed);
  Recording result;
  const auto attitude = [&](double t_s) {
    return Mat3(motion.T_world_imu(t_s).R() * so3_exp(normal_vector(rng, noise_rad)));
  };
  Mat3 before = attitude(0);
  for (int i = 1; i <= 90; ++i) {
    const Mat3 now = attitude(i / 30.0);
    result.turns.push_back(
        {{to_ns((i - 1) / 30.0)}, {to_ns(i / 30.0)}, so3_log(before.transpose() * now)});
    before = now;
  }
  const int around = static_cast<int>(std::lround((around_s + 0.4) * 200));
  for (int i = -40 - around; i < 660 + around; ++i) {
    ImuSample sample = motion.reading({to_ns(i / 200.0)}, {0, 0, -9.8});
    sample.angular_velocity_radps += Vec3(0.02, -0.01, 0.03) + normal_vector(rng, 0.003);
    sample.stamp.ns += to_ns(offset_s);
    result.samples.push_back(sample);
  }
  return result;
}

RC_GTEST_PROP(TimeOffsetProperties, IsFoundToAMillisecond, ()) {
  const double offset_s = properties::real(-0.09, 0.09);
  const auto seed = static_cast<std::uint64_t>(*rc::gen::inRange(0, 50));
  const Recording r = recorded(offset_s, 2, seed, 1e-3);
  const auto found = estimate_time_offset(r.turns, r.samples);
  RC_ASSERT(found.has_value());
  RC_ASSERT(std::abs(found->offset_s - offset_s) < 2e-3);
  RC_ASSERT(std::abs(found->offset_s - offset_s) < 5 * found->sigma_s + 4e-4);
  RC_ASSERT(found->explained > 0.8);
}

TEST(TimeOffset, WithoutNoiseIsExact) {
  const Recording r = recorded(0.0123, 1, 3, 0);
  EXPECT_NEAR(estimate_time_offset(r.turns, r.samples)->offset_s, 0.0123, 3e-4);
}

TEST(TimeOffset, IsNotToldByACameraAtRest) {
  const Recording r = recorded(0.02, 0, 3, 5e-4);
  EXPECT_FALSE(estimate_time_offset(r.turns, r.samples));
}

TEST(TimeOffset, BeyondReachIsNotToldAsSomethingElse) {
  const Recording r = recorded(0.15, 1, 3, 1e-4);
  EXPECT_FALSE(estimate_time_offset(r.turns, r.samples));
}

TEST(TimeOffset, OfAnotherMotionIsNotExplained) {
  Recording r = recorded(0, 1, 3, 1e-4);
  r.samples = recorded(0, 1, 4, 1e-4).samples;
  const auto found = estimate_time_offset(r.turns, r.samples);
  EXPECT_TRUE(!found || found->explained < 0.5);
}

TEST(TimeOffset, IsFoundFarAway) {
  for (const double offset_s : {-0.4, 0.15, 0.3}) {
    const Recording r = recorded(offset_s, 1, 3, 1e-3, 0.5);
    EXPECT_NEAR(estimate_time_offset(r.turns, r.samples, 0.5)->offset_s, offset_s, 4e-3);
    EXPECT_GT(most_explained(r.turns, r.samples, 0.5), 0.9);
  }
}

TEST(TimeOffset, OfAnotherMotionNothingFits) {
  Recording r = recorded(0, 1, 3, 1e-3, 0.5);
  r.samples = recorded(0, 1, 4, 1e-3, 0.5).samples;
  EXPECT_LT(most_explained(r.turns, r.samples, 0.5), 0.6);
  // Vision's noise explains nothing, and a camera at rest neither.
  EXPECT_EQ(most_explained(recorded(0, 0, 3, 2e-3, 0.5).turns, r.samples, 0.5), 1);
}

TEST(TimeOffset, NeedsSamplesAndTurns) {
  const Recording r = recorded(0, 1, 3, 1e-4);
  EXPECT_FALSE(estimate_time_offset({}, r.samples));
  EXPECT_FALSE(estimate_time_offset(r.turns, {}));
}

}  // namespace
}  // namespace ygslam
