#include "bag/imu_halves.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace ygslam {
namespace {

constexpr std::int64_t kHalfMs_ns = 500'000;

ImuSample rate_at(std::int64_t half_ms) {
  return {{half_ms * kHalfMs_ns}, Vec3(0.1, 0.2, static_cast<double>(half_ms)), Vec3::Zero()};
}
/// Acceleration that grows evenly.
ImuSample force_at(std::int64_t half_ms) {
  return {{half_ms * kHalfMs_ns}, Vec3::Zero(), Vec3(0, static_cast<double>(half_ms), 9.8)};
}

std::vector<std::int64_t> stamps_of(const std::vector<ImuSample>& samples) {
  std::vector<std::int64_t> stamps;
  for (const ImuSample& sample : samples) {
    const std::int64_t stamp = sample.stamp.ns / kHalfMs_ns;
    EXPECT_EQ(sample.angular_velocity_radps.z(), static_cast<double>(stamp));
    EXPECT_NEAR(sample.specific_force_mps2.y(), static_cast<double>(stamp), 1e-9);
    EXPECT_EQ(sample.specific_force_mps2.z(), 9.8);
    stamps.push_back(stamp);
  }
  return stamps;
}

using HalfMs = std::vector<std::int64_t>;

TEST(ImuHalves, AccelerationsAreInterpolatedWhicheverHalfIsLate) {
  for (const bool gyro_late : {false, true}) {
    ImuHalves halves;
    const auto add_gyro = [&] {
      for (std::int64_t t = 0; t <= 100; t += 10) halves.add_gyro(rate_at(t));
    };
    if (!gyro_late) add_gyro();
    for (std::int64_t t = 7; t <= 97; t += 30) halves.add_accel(force_at(t));
    if (gyro_late) add_gyro();
    EXPECT_EQ(stamps_of(halves.take()), HalfMs({10, 20, 30, 40, 50, 60, 70, 80, 90})) << gyro_late;
    EXPECT_TRUE(halves.take().empty());
    halves.add_accel(force_at(100));
    EXPECT_EQ(stamps_of(halves.take()), HalfMs({100})) << "the same stamp";
  }
}

TEST(ImuHalves, WhatIsBesideAGapIsLeftOut) {
  ImuHalves halves;
  for (const std::int64_t t : {0, 20, 400, 420}) halves.add_accel(force_at(t));
  for (const std::int64_t t : {10, 20, 30, 210, 399, 400, 410}) halves.add_gyro(rate_at(t));
  EXPECT_EQ(stamps_of(halves.take()), HalfMs({10, 20, 400, 410}));
}

TEST(ImuHalves, AClockThatIsSetBeginsAnew) {
  ImuHalves halves;
  const auto one_second = [&](std::int64_t begin) {
    for (std::int64_t t = begin; t <= begin + 2000; t += 10) {
      halves.add_gyro(rate_at(t));
      halves.add_accel(force_at(t));
    }
    return halves.take().size();
  };
  EXPECT_EQ(one_second(1'000'000), 201U);
  EXPECT_EQ(one_second(0), 201U);
  EXPECT_EQ(one_second(5'000'000), 201U);
}

TEST(ImuHalves, AReadingOutOfOrderIsLeftOut) {
  ImuHalves halves;
  for (const std::int64_t t : {0, 30, 20, 60}) halves.add_accel(force_at(t));
  for (const std::int64_t t : {10, 20, 20, 15, 40}) halves.add_gyro(rate_at(t));
  EXPECT_EQ(stamps_of(halves.take()), HalfMs({10, 20, 40}));
}

TEST(ImuHalves, StampsOfAnyTimeAreTaken) {
  constexpr std::int64_t kLast = std::numeric_limits<std::int64_t>::max();
  constexpr std::int64_t kFirst = std::numeric_limits<std::int64_t>::min();
  ImuHalves halves;
  for (const std::int64_t a : {kFirst, std::int64_t{0}, kLast, kFirst})
    for (const std::int64_t b : {kLast, kFirst, kLast}) {
      halves.add_gyro({{a}, Vec3::UnitX(), Vec3::Zero()});
      halves.add_accel({{b}, Vec3::Zero(), Vec3::UnitZ()});
    }
  for (const ImuSample& sample : halves.take()) EXPECT_TRUE(sample.specific_force_mps2.allFinite());
}

TEST(ImuHalves, WithoutAPartnerTheOldestGo) {
  ImuHalves halves;
  constexpr auto kMost = static_cast<std::int64_t>(ImuHalves::kMostWaiting);
  for (std::int64_t t = 0; t < kMost + 5; ++t) halves.add_gyro(rate_at(t));
  halves.add_accel(force_at(0));
  halves.add_accel(force_at(10));
  EXPECT_EQ(stamps_of(halves.take()), HalfMs({5, 6, 7, 8, 9, 10}));
}

}  // namespace
}  // namespace ygslam
