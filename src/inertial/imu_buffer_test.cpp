#include "inertial/imu_buffer.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "inertial/inertial_test_world.hpp"

namespace ygslam {
namespace {

constexpr double kPeriod_s = 0.005;

ImuSample still_sample(double t_s, Rng& rng) {
  return {{to_ns(t_s)},
          inertial_world::normal_vector(rng, 0.003),
          Vec3(0, 0, 9.81) + inertial_world::normal_vector(rng, 0.02)};
}

// Of `until_s`, without those for which `is_missing`.
template <typename IsMissing>
ImuBuffer filled(double until_s, const IsMissing& is_missing) {
  ImuBuffer buffer{ImuNoise{}};
  Rng rng(1);
  for (int i = 0; i * kPeriod_s <= until_s; ++i) {
    const ImuSample sample = still_sample(i * kPeriod_s, rng);
    if (!is_missing(i * kPeriod_s)) buffer.add(sample);
  }
  return buffer;
}
constexpr auto kNone = [](double) { return false; };

double turn_std(const Preintegration& motion) { return std::sqrt(motion.covariance()(0, 0)); }

TEST(ImuBuffer, KnowsTheNoiseOfGoodSamples) {
  const auto motion = filled(1, kNone).between({0}, {to_ns(1)}, {});
  ASSERT_TRUE(motion);
  EXPECT_NEAR(turn_std(*motion), ImuNoise{}.gyro_noise_radps_sqrthz, 1e-6);
}

TEST(ImuBuffer, IsUncertainWhereSamplesAreMissing) {
  const auto gap = [](double t_s) { return t_s > 0.50 && t_s < 0.57; };
  const ImuBuffer buffer = filled(1, gap);
  EXPECT_GT(turn_std(*buffer.between({0}, {to_ns(1)}, {})), 0.03);
  EXPECT_LT(turn_std(*buffer.between({0}, {to_ns(0.4)}, {})), 3e-4);
}

TEST(ImuBuffer, SaysNothingOfALongGap) {
  const auto gap = [](double t_s) { return t_s > 0.50 && t_s < 0.7; };
  const ImuBuffer buffer = filled(1, gap);
  EXPECT_FALSE(buffer.between({0}, {to_ns(1)}, {}));
  EXPECT_FALSE(buffer.between({to_ns(0.6)}, {to_ns(0.65)}, {}));
  EXPECT_TRUE(buffer.between({to_ns(0.71)}, {to_ns(1)}, {}));
}

TEST(ImuBuffer, HoldsTheNewestReadingForAMoment) {
  const ImuBuffer buffer = filled(0.5, kNone);
  EXPECT_TRUE(buffer.between({0}, {to_ns(0.51)}, {}));
  EXPECT_FALSE(buffer.between({0}, {to_ns(0.62)}, {}));
  EXPECT_FALSE(buffer.between({-1}, {to_ns(0.1)}, {}));
}

TEST(ImuBuffer, ReadingsAtTheEndOfTheRangeAreNotBelieved) {
  ImuBuffer buffer{ImuNoise{}};
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    ImuSample sample = still_sample(i * kPeriod_s, rng);
    if (i >= 100 && i < 110) sample.angular_velocity_radps.y() = 4.36332;  // 250 deg/s
    buffer.add(sample);
  }
  EXPECT_TRUE(buffer.was_clipped({to_ns(0.5)}, {to_ns(0.55)}));
  EXPECT_FALSE(buffer.was_clipped({0}, {to_ns(0.49)}));
  EXPECT_FALSE(buffer.was_clipped({to_ns(0.56)}, {to_ns(1)}));
  EXPECT_GT(turn_std(*buffer.between({to_ns(0.45)}, {to_ns(0.6)}, {})), 0.1);
}

TEST(ImuBuffer, EqualReadingsAtRestAreNoEnd) {
  ImuBuffer buffer{ImuNoise{}};
  for (int i = 0; i < 50; ++i)
    buffer.add({{to_ns(i * kPeriod_s)}, Vec3(0.01, 0, 0), Vec3(0, 0, 9.81)});
  EXPECT_FALSE(buffer.was_clipped({0}, {to_ns(1)}));
}

TEST(ImuBuffer, PassesOverWhatIsOldOrNoNumber) {
  ImuBuffer buffer = filled(0.1, kNone);
  const auto count = buffer.samples().size();
  Rng rng(2);
  EXPECT_EQ(buffer.add(still_sample(0.05, rng)), ImuBuffer::Verdict::kPassedOver);
  EXPECT_EQ(buffer.add(still_sample(0.1, rng)), ImuBuffer::Verdict::kPassedOver);
  ImuSample broken = still_sample(0.2, rng);
  broken.specific_force_mps2.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(buffer.add(broken), ImuBuffer::Verdict::kPassedOver);
  broken.specific_force_mps2.x() = 1e9;
  EXPECT_EQ(buffer.add(broken), ImuBuffer::Verdict::kPassedOver);
  EXPECT_EQ(buffer.samples().size(), count);
  EXPECT_EQ(buffer.add(still_sample(0.105, rng)), ImuBuffer::Verdict::kTaken);
}

TEST(ImuBuffer, AClockThatStaysBehindWasSetBack) {
  ImuBuffer buffer = filled(10, kNone);
  Rng rng(2);
  int i = 0;
  while (buffer.add(still_sample(1 + i * kPeriod_s, rng)) == ImuBuffer::Verdict::kPassedOver) ++i;
  EXPECT_EQ(i, 19);
  EXPECT_EQ(buffer.samples().size(), 1U);
}

TEST(ImuBuffer, OneWildStampIsLeftOut) {
  ImuBuffer buffer = filled(1, kNone);
  const auto count = buffer.samples().size();
  Rng rng(2);
  EXPECT_EQ(buffer.add(still_sample(2147483648.0, rng)), ImuBuffer::Verdict::kPassedOver);
  EXPECT_EQ(buffer.add(still_sample(1.005, rng)), ImuBuffer::Verdict::kTaken);
  EXPECT_EQ(buffer.samples().size(), count + 1);
  for (int i = 0; i < 20; ++i)  // each elsewhere
    EXPECT_EQ(buffer.add(still_sample(5000 + 100.0 * i, rng)), ImuBuffer::Verdict::kPassedOver);
  EXPECT_EQ(buffer.add(still_sample(1.01, rng)), ImuBuffer::Verdict::kTaken);
}

TEST(ImuBuffer, GoesOnAfterALongPause) {
  ImuBuffer buffer = filled(1, kNone);
  Rng rng(2);
  int i = 0;
  while (buffer.add(still_sample(30 + i * kPeriod_s, rng)) == ImuBuffer::Verdict::kPassedOver) ++i;
  EXPECT_EQ(i, 4);
  EXPECT_EQ(buffer.samples().back().stamp.ns, to_ns(30 + 4 * kPeriod_s));
}

TEST(ImuBuffer, ABurstOfStampsSpoilsNothingForLong) {
  ImuBuffer buffer = filled(1, kNone);
  Rng rng(2);
  for (int i = 1; i <= 40'000; ++i) {
    ImuSample sample = still_sample(1, rng);
    sample.stamp.ns += 4 * i;
    buffer.add(sample);
  }
  for (int i = 1; i <= 400; ++i) buffer.add(still_sample(1 + i * kPeriod_s, rng));
  const auto motion = buffer.between({to_ns(2)}, {to_ns(3)}, {});
  ASSERT_TRUE(motion);
  EXPECT_NEAR(turn_std(*motion), ImuNoise{}.gyro_noise_radps_sqrthz, 1e-6);
}

TEST(ImuBuffer, ForgetsWhatIsNotNeededAnyMore) {
  ImuBuffer buffer = filled(1, kNone);
  buffer.forget_before({to_ns(0.5025)});
  EXPECT_EQ(buffer.samples().front().stamp.ns, to_ns(0.5));
  EXPECT_TRUE(buffer.between({to_ns(0.5025)}, {to_ns(1)}, {}));
}

TEST(ImuBuffer, ShiftedSamplesAreThoseOfAnotherTime) {
  ImuBuffer buffer = filled(1, kNone);
  const Vec3 before = buffer.reading({to_ns(0.5)})->specific_force_mps2;
  buffer.shift(to_ns(0.1));
  EXPECT_EQ(buffer.reading({to_ns(0.6)})->specific_force_mps2, before);
}

// A second at rest, after `change` of each sample; its delta of velocity less that of gravity.
template <typename Change>
ImuBuffer changed(const Change& change, const ImuRange& range = {}) {
  ImuBuffer buffer{ImuNoise{}, 0, range};
  Rng rng(1);
  for (int i = 0; i <= 200; ++i) {
    ImuSample sample = still_sample(i * kPeriod_s, rng);
    change(i, sample);
    buffer.add(sample);
  }
  return buffer;
}

MotionDelta motion_of(const ImuBuffer& buffer) {
  return buffer.between({0}, {to_ns(1)}, {})->delta();
}

TEST(ImuBuffer, OneWrongReadingIsMissing) {
  const MotionDelta right = motion_of(filled(1, kNone));
  for (const double accel_mps2 : {25.0, -39.0, 150.0, 1000.0}) {
    const ImuBuffer buffer = changed([&](int i, ImuSample& s) {
      if (i == 100) s.specific_force_mps2.x() = accel_mps2;
    });
    EXPECT_EQ(buffer.samples().size(), 200U);
    EXPECT_NEAR((motion_of(buffer).v - right.v).norm(), 0, 1e-3);
    EXPECT_GT(turn_std(*buffer.between({0}, {to_ns(1)}, {})), 5e-3);
    EXPECT_EQ(buffer.why_missing({to_ns(0.4)}), ImuFault::kRange);
    EXPECT_EQ(buffer.why_missing({to_ns(0.6)}), ImuFault::kSilent);
  }
  for (const double gyro_radps : {4.0, -17.0, 30.0, 1000.0}) {
    const ImuBuffer buffer = changed([&](int i, ImuSample& s) {
      if (i == 100) s.angular_velocity_radps.y() = gyro_radps;
    });
    EXPECT_EQ(buffer.samples().size(), 200U);
    EXPECT_NEAR(so3_log(motion_of(buffer).R.transpose() * right.R).norm(), 0, 1e-3);
  }
}

TEST(ImuBuffer, AWrongReadingIsNeverTheNewest) {
  ImuBuffer buffer = filled(1, kNone);
  Rng rng(2);
  ImuSample wrong = still_sample(1.005, rng);
  wrong.specific_force_mps2.x() = 39;
  buffer.add(wrong);
  EXPECT_LT(buffer.reading({to_ns(1.01)})->specific_force_mps2.x(), 1);
}

TEST(ImuBuffer, JoltsAreMotion) {
  for (const int length : {2, 3, 6}) {
    const ImuBuffer buffer = changed([&](int i, ImuSample& s) {
      if (i >= 100 && i < 100 + length) s.specific_force_mps2.x() += 30;
    });
    EXPECT_EQ(buffer.samples().size(), 201U);
    EXPECT_NEAR(motion_of(buffer).v.x(), 30 * length * kPeriod_s, 0.02);
  }
  // What shakes about the rate of the samples themselves is taken as it comes.
  const ImuBuffer shaken = changed([](int i, ImuSample& s) {
    if (i >= 50) s.specific_force_mps2.x() += i % 2 == 0 ? 12 : -12;
  });
  EXPECT_GE(shaken.samples().size(), 200U);
}

TEST(ImuBuffer, BeyondItsRangeNothingIsBelieved) {
  const auto burst = [](int i, ImuSample& s) {
    if (i >= 100 && i < 104) s.specific_force_mps2.x() = 60;
  };
  EXPECT_EQ(changed(burst).samples().size(), 201U);
  EXPECT_EQ(changed(burst, {.gyro_radps = 17.5, .accel_mps2 = 39.2}).samples().size(), 197U);
  EXPECT_EQ(changed(burst, {.gyro_radps = 17.5, .accel_mps2 = 58}).samples().size(), 201U);
}

TEST(ImuBuffer, NoAccelerationAtAllIsNoReading) {
  const ImuBuffer buffer = changed([](int i, ImuSample& s) {
    if (i >= 100) s.specific_force_mps2.setZero();
  });
  EXPECT_EQ(buffer.samples().size(), 100U);
  EXPECT_EQ(buffer.why_missing({to_ns(0.5)}), ImuFault::kStands);
  EXPECT_FALSE(buffer.between({0}, {to_ns(0.7)}, {}));
}

TEST(ImuBuffer, ReadingsThatStayTheSameAreMissing) {
  for (const bool is_gyro : {true, false}) {
    ImuSample held;
    const ImuBuffer buffer = changed([&](int i, ImuSample& s) {
      if (i <= 100) held = s;
      if (i > 150 || i <= 100) return;
      if (is_gyro) s.angular_velocity_radps = held.angular_velocity_radps;
      if (!is_gyro) s.specific_force_mps2 = held.specific_force_mps2;
    });
    EXPECT_EQ(buffer.samples().size(), 151U);  // the first of them stays
    EXPECT_EQ(buffer.why_missing({to_ns(0.5)}), ImuFault::kStands);
    EXPECT_FALSE(buffer.between({to_ns(0.4)}, {to_ns(0.7)}, {}));
    EXPECT_TRUE(buffer.between({to_ns(0.77)}, {to_ns(1)}, {}));
  }
}

TEST(ImuBuffer, SlowSensorsMayRepeatTheirReadings) {
  for (const int times : {2, 4, 8}) {
    Vec3 held = Vec3::Zero();
    const ImuBuffer buffer = changed([&](int i, ImuSample& s) {
      if (i % times == 0) held = s.specific_force_mps2;
      s.specific_force_mps2 = held;
    });
    EXPECT_EQ(buffer.samples().size(), 201U);
  }
}

TEST(ImuBuffer, CoarseTextAtRestIsAlive) {
  const auto rounded = [](Vec3& v, double step) { v = step * (v / step).array().round(); };
  const ImuBuffer buffer = changed([&](int i, ImuSample& s) {
    if (i < 50) s.angular_velocity_radps.x() += 0.01 * i;
    rounded(s.angular_velocity_radps, 0.01);
    rounded(s.specific_force_mps2, 0.1);
  });
  EXPECT_EQ(buffer.samples().size(), 201U);
}

}  // namespace
}  // namespace ygslam
