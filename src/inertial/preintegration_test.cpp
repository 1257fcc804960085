#include "inertial/preintegration.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <optional>
#include <span>

#include "geometry/properties_testing.hpp"
#include "inertial/inertial_test_world.hpp"

namespace ygslam {
namespace {

using inertial_world::NoisyImu;
using inertial_world::SmoothMotion;
using Vec9 = Eigen::Matrix<double, 9, 1>;

const Vec3 kGravity(0, 0, -9.80665);

std::vector<ImuSample> true_readings(const SmoothMotion& motion, double until_s, double rate_hz) {
  std::vector<ImuSample> samples;
  for (int i = 0; i <= static_cast<int>(until_s * rate_hz); ++i)
    samples.push_back(motion.reading({to_ns(i / rate_hz)}, kGravity));
  return samples;
}

// What the delta between two instants is in truth.
MotionDelta true_delta(const SmoothMotion& motion, double from_s, double to_s) {
  const SE3 a = motion.T_world_imu(from_s), b = motion.T_world_imu(to_s);
  const Vec3 v = motion.velocity(from_s);
  const double dt = to_s - from_s;
  const Mat3 R = a.R().transpose();
  return {dt, R * b.R(), R * (motion.velocity(to_s) - v - kGravity * dt),
          R * (b.t() - a.t() - v * dt - 0.5 * dt * dt * kGravity)};
}

// @return error of `a`, as Preintegration has it.
Vec9 difference(const MotionDelta& a, const MotionDelta& b) {
  Vec9 error;
  error << so3_log(b.R.transpose() * a.R), a.v - b.v, a.p - b.p;
  return error;
}

// @param samples in order of time, from at or before `from` to at or after `to`; readings at the
// ends are interpolated. @return nullopt if they do not reach.
std::optional<Preintegration> preintegrate(std::span<const ImuSample> samples, Timestamp from,
                                           Timestamp to, const ImuBias& bias,
                                           const Preintegration::Noise& noise) {
  if (samples.empty() || samples.front().stamp > from || samples.back().stamp < to || to < from)
    return std::nullopt;
  Preintegration result(bias);
  auto after = std::ranges::upper_bound(samples, from, {}, &ImuSample::stamp);
  for (; after != samples.end() && (after - 1)->stamp < to; ++after) {
    const ImuSample& before = *(after - 1);
    const ImuSample first = interpolated(before, *after, std::max(from, before.stamp));
    const ImuSample last = interpolated(before, *after, std::min(to, after->stamp));
    const double dt_s = seconds_between(last.stamp, first.stamp);
    if (dt_s <= 0) continue;
    result.add(0.5 * (first.angular_velocity_radps + last.angular_velocity_radps),
               0.5 * (first.specific_force_mps2 + last.specific_force_mps2), dt_s, noise);
  }
  return result;
}

Preintegration integrated(std::span<const ImuSample> samples, double from_s, double to_s,
                          const ImuBias& bias = {}) {
  auto result = preintegrate(samples, {to_ns(from_s)}, {to_ns(to_s)}, bias, {1e-3, 1e-2});
  EXPECT_TRUE(result);
  return *result;
}

RC_GTEST_PROP(PreintegrationProperties, AgreesWithTheTrueMotion, ()) {
  const SmoothMotion motion(static_cast<std::uint64_t>(*rc::gen::inRange(0, 1000)));
  const double from_s = properties::real(0, 0.5), to_s = from_s + properties::real(0.02, 1.0);
  const auto samples = true_readings(motion, 2, 400);
  const Vec9 error =
      difference(integrated(samples, from_s, to_s).delta(), true_delta(motion, from_s, to_s));
  RC_ASSERT(error.head<3>().norm() < 2e-4 * (to_s - from_s));
  RC_ASSERT(error.segment<3>(3).norm() < 2e-3 * (to_s - from_s));
  RC_ASSERT(error.tail<3>().norm() < 2e-3 * (to_s - from_s));
}

TEST(Preintegration, ErrsLessByTheSquareOfTheRate) {
  const SmoothMotion motion(3);
  const auto error_at = [&](double rate_hz) {
    const auto samples = true_readings(motion, 1.2, rate_hz);
    return difference(integrated(samples, 0.1, 1.1).delta(), true_delta(motion, 0.1, 1.1)).norm();
  };
  const double coarse = error_at(100), fine = error_at(200);
  EXPECT_NEAR(coarse / fine, 4, 0.6);
  EXPECT_LT(error_at(20'000), 1e-6);  // brute force
}

RC_GTEST_PROP(PreintegrationProperties, PartsMakeTheWhole, ()) {
  const SmoothMotion motion(static_cast<std::uint64_t>(*rc::gen::inRange(0, 1000)));
  const auto samples = true_readings(motion, 1, 200);
  const double middle_s = 0.005 * *rc::gen::inRange(1, 150);  // a sample's stamp
  const auto whole = integrated(samples, 0, 0.8);
  const auto first = integrated(samples, 0, middle_s), second = integrated(samples, middle_s, 0.8);
  const MotionDelta parts = first.delta().then(second.delta());
  RC_ASSERT(difference(parts, whole.delta()).norm() < 1e-9);
  RC_ASSERT(std::abs(parts.duration_s - 0.8) < 1e-9);
}

RC_GTEST_PROP(PreintegrationProperties, BiasJacobianMatchesFiniteDifferences, ()) {
  const SmoothMotion motion(static_cast<std::uint64_t>(*rc::gen::inRange(0, 1000)));
  const auto samples = true_readings(motion, 0.6, 100);
  const ImuBias bias{properties::vector(0.05), properties::vector(0.3)};
  const Preintegration centre = integrated(samples, 0.003, 0.5, bias);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 6; ++i) {
    const auto at = [&](double step) {
      ImuBias moved = bias;
      (i < 3 ? moved.gyro_radps[i] : moved.accel_mps2[i - 3]) += step;
      return integrated(samples, 0.003, 0.5, moved).delta();
    };
    const Vec9 derivative =
        (difference(at(kStep), centre.delta()) - difference(at(-kStep), centre.delta())) /
        (2 * kStep);
    RC_ASSERT((centre.bias_jacobian().col(i) - derivative).norm() < 1e-6);
  }
}

TEST(Preintegration, CorrectionForABiasIsOfFirstOrder) {
  const auto samples = true_readings(SmoothMotion(5), 0.6, 200);
  const Preintegration start = integrated(samples, 0, 0.5);
  const auto error_at = [&](double scale) {
    const ImuBias bias{scale * Vec3(0.01, -0.02, 0.015), scale * Vec3(0.1, 0.2, -0.1)};
    return difference(start.corrected(bias), integrated(samples, 0, 0.5, bias).delta()).norm();
  };
  EXPECT_LT(error_at(1), 1e-3);  // of 0.07 that is corrected
  EXPECT_NEAR(error_at(1) / error_at(0.5), 4, 0.5);
}

TEST(Preintegration, CovarianceIsThatOfManyNoisyRuns) {
  const SmoothMotion motion(7);
  const auto truth = true_readings(motion, 0.5, 200);
  ImuNoise noise{.rate_hz = 200, .gyro_walk_radps2_sqrthz = 0, .accel_walk_mps3_sqrthz = 0};
  const Preintegration::Noise density{noise.gyro_noise_radps_sqrthz, noise.accel_noise_mps2_sqrthz};
  const auto of = [&](const std::vector<ImuSample>& samples) {
    return *preintegrate(samples, {0}, {to_ns(0.5)}, {}, density);
  };
  const Preintegration clean = of(truth);
  NoisyImu imu(noise, {}, 11);
  constexpr int kRuns = 4000;
  Mat9 sampled = Mat9::Zero();
  for (int run = 0; run < kRuns; ++run) {
    std::vector<ImuSample> samples;
    for (const ImuSample& sample : truth) samples.push_back(imu.measure(sample));
    const Vec9 error = difference(of(samples).delta(), clean.delta());
    sampled += error * error.transpose() / kRuns;
  }
  // In the predicted covariance's own axes the sampled one is the identity: 2 % for each variance.
  const Eigen::LLT<Mat9> root(clean.covariance());
  const Mat9 half = root.matrixL().solve(sampled);
  const Mat9 whitened = root.matrixL().solve(half.transpose());
  EXPECT_LT((whitened - Mat9::Identity()).cwiseAbs().maxCoeff(), 0.1) << whitened;
}

TEST(Preintegration, TwoPartsAreAsUncertainAsTheWhole) {
  const auto samples = true_readings(SmoothMotion(9), 1, 200);
  const Preintegration whole = integrated(samples, 0, 0.8);
  Preintegration steps({});
  for (int i = 0; i < 160; ++i) {
    const auto& a = samples[static_cast<std::size_t>(i)];
    const auto& b = samples[static_cast<std::size_t>(i) + 1];
    steps.add(0.5 * (a.angular_velocity_radps + b.angular_velocity_radps),
              0.5 * (a.specific_force_mps2 + b.specific_force_mps2), 0.005, {1e-3, 1e-2});
  }
  EXPECT_LT((whole.covariance() - steps.covariance()).norm(), 1e-9);
}

TEST(Preintegration, NeedsSamplesOfTheWholeTime) {
  const auto samples = true_readings(SmoothMotion(1), 0.5, 200);
  const auto of = [&](std::int64_t from_ns, std::int64_t to_ns) {
    return preintegrate(samples, {from_ns}, {to_ns}, {}, {});
  };
  EXPECT_FALSE(of(-1, 1000));
  EXPECT_FALSE(of(0, to_ns(0.5) + 1));
  EXPECT_FALSE(of(1000, 0));
  EXPECT_FALSE(preintegrate({}, {0}, {0}, {}, {}));
  ASSERT_TRUE(of(0, to_ns(0.5)));
  EXPECT_NEAR(of(0, to_ns(0.5))->duration_s(), 0.5, 1e-9);
  EXPECT_EQ(of(1000, 1000)->duration_s(), 0);
}

TEST(Preintegration, AnIntervalBetweenTwoSamplesUsesBoth) {
  const std::vector<ImuSample> samples{{{0}, Vec3::Zero(), Vec3::Zero()},
                                       {{to_ns(1)}, Vec3(0, 0, 1), Vec3(4, 0, 0)}};
  const auto part = integrated(samples, 0.25, 0.75);
  EXPECT_NEAR(so3_log(part.delta().R).z(), 0.25, 1e-9);
  EXPECT_NEAR(part.delta().v.norm(), 1.0, 1e-9);
}

}  // namespace
}  // namespace ygslam
