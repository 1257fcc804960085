#include "simulation/sensor/imu_sensor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "simulation/world/world_config.hpp"

namespace ygslam::sim {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
const Vec3 kGravity_world(0, 0, -kStandardGravity_mps2);

CameraPath path_of(const std::string& world) {
  const Result<WorldConfig> config = load_world(world);
  CHECK(config.ok());
  return CameraPath(config->camera);
}

ImuOptions options_of(const char* model) {
  ImuOptions options;
  options.model = *find_imu_model(model);
  return options;
}

TrueMotion at_rest() {
  TrueMotion rest;
  rest.specific_force_mps2 = -kGravity_world;
  return rest;
}

/// Pose after all readings by the midpoint rule, from the true pose and velocity of the first.
SE3 integrated(const std::vector<ImuReading>& readings) {
  Mat3 R = readings[0].truth.T_world_imu.R();
  Vec3 p = readings[0].truth.T_world_imu.t();
  Vec3 v = readings[0].truth.velocity_world_mps;
  for (std::size_t i = 1; i < readings.size(); ++i) {
    const ImuSample &a = readings[i - 1].sample, &b = readings[i].sample;
    const double dt_s = seconds_between(b.stamp, a.stamp);
    const Mat3 R_next =
        R * so3_exp(0.5 * dt_s * (a.angular_velocity_radps + b.angular_velocity_radps));
    const Vec3 acceleration =
        0.5 * (R * a.specific_force_mps2 + R_next * b.specific_force_mps2) + kGravity_world;
    p += dt_s * v + 0.5 * dt_s * dt_s * acceleration;
    v += dt_s * acceleration;
    R = R_next;
  }
  return {R, p};
}

// The readings say how the camera moved: a second of them leads from one true pose to the other.
TEST(ImuSensor, ReadingsWithoutErrorsLeadAlongTheTruePath) {
  ImuOptions options = options_of("ideal");
  options.rate_hz = 400;
  for (const char* world : {"walking_xyz", "walking_rpy", "walking_halfsphere", "walking_static",
                            "corridor_loop", "room_walk", "twin_rooms_return", "office_evening"}) {
    const CameraPath path = path_of(world);
    for (double from_s = 0; from_s < 20; from_s += 0.85) {
      const auto readings = imu_readings(path, options, {}, from_s, from_s + 1);
      const SE3 felt = readings.back().truth.T_world_imu;
      const SE3 error = felt.inverse() * integrated(readings);
      EXPECT_LT(error.t().norm(), 5e-4) << world << from_s;
      EXPECT_LT(error.angle(), 0.005 * kDegree) << world << from_s;
      // And the truth is that of the images.
      const SE3 seen = path.T_world_camera(readings.back().t_s) * options.T_camera_imu;
      EXPECT_LT((seen.inverse() * felt).t().norm(), 1e-3) << world << from_s;
      EXPECT_LT((seen.inverse() * felt).angle(), 0.03 * kDegree) << world << from_s;
    }
  }
}

TEST(ImuSensor, FeltMotionStaysWithTheImagesAndWithinWhatSensorsStand) {
  for (const WorldName& name : known_worlds()) {
    if (name.name == "long_floor") continue;  // turns round in no time: see CameraPath
    const Result<WorldConfig> world = load_world(name.name);
    ASSERT_TRUE(world.ok());
    const CameraPath path(world->camera);
    for (double t_s = 0; t_s < std::min(world->seconds, 110.0); t_s += 0.017) {
      const SE3 felt = path.T_world_camera_felt(t_s, t_s);
      const SE3 error = path.T_world_camera(t_s).inverse() * felt;
      ASSERT_LT(error.t().norm(), 4e-3) << name.name << t_s;
      ASSERT_LT(error.angle(), 0.25 * kDegree) << name.name << t_s;
      const TrueMotion motion =
          true_motion([&](double when_s) { return path.T_world_camera_felt(when_s, t_s); }, t_s);
      ASSERT_LT(motion.specific_force_mps2.norm(), 4 * kStandardGravity_mps2) << name.name << t_s;
      ASSERT_LT(motion.angular_velocity_radps.norm(), 1000 * kDegree) << name.name << t_s;
    }
  }
}

TEST(ImuSensor, FeelsNoKidnapping) {
  const auto readings = imu_readings(path_of("kidnap"), options_of("ideal"), {}, 9.9, 14.1);
  double moved_m = 0;
  for (std::size_t i = 1; i < readings.size(); ++i) {
    EXPECT_NEAR(readings[i].sample.specific_force_mps2.norm(), kStandardGravity_mps2, 1.5);
    moved_m = std::max(
        moved_m,
        (readings[i].truth.T_world_imu.t() - readings[i - 1].truth.T_world_imu.t()).norm());
  }
  EXPECT_GT(moved_m, 1);  // somebody did carry it
}

TEST(TrueMotion, AtRestIsGravityUpwards) {
  const SE3 pose(so3_exp(Vec3(0.3, -1, 2)), Vec3(40, -30, 1.4));
  const TrueMotion motion = true_motion([&](double) -> const SE3& { return pose; }, 7);
  EXPECT_LT(motion.angular_velocity_radps.norm(), 1e-12);
  EXPECT_LT(motion.velocity_world_mps.norm(), 1e-12);
  EXPECT_LT((pose.R() * motion.specific_force_mps2 + kGravity_world).norm(), 1e-7);
}

// On a circle of radius r at w rad/s: w about z, w^2 r towards the middle.
TEST(TrueMotion, OnACircleIsCentripetal) {
  const double w = 3, r = 0.7;
  const Motion motion = [&](double t_s) {
    const Mat3 R = so3_exp(Vec3(0, 0, w * t_s));
    return SE3(R, R * Vec3(r, 0, 0));
  };
  for (const double t_s : {0.0, 0.4, 11.0}) {
    const TrueMotion m = true_motion(motion, t_s);
    EXPECT_LT((m.angular_velocity_radps - Vec3(0, 0, w)).norm(), 1e-8);
    EXPECT_LT((m.specific_force_mps2 - Vec3(-w * w * r, 0, kStandardGravity_mps2)).norm(), 1e-6);
    EXPECT_LT((m.T_world_imu.R().transpose() * m.velocity_world_mps - Vec3(0, w * r, 0)).norm(),
              1e-8);
  }
}

TEST(ImuSensor, NoiseAndStartBiasesAreThoseOfTheModel) {
  for (const char* name : {"BMI055", "BMI085", "ICM-42688"}) {
    ImuOptions options = options_of(name);
    const ImuModel& m = options.model;
    double gyro_sum = 0, accel_sum = 0, gyro_bias = 0, accel_bias = 0, gain = 0;
    int n = 0;
    constexpr int kSensors = 300, kReadings = 100;
    for (options.seed = 1; options.seed <= kSensors; ++options.seed) {
      ImuSensor sensor(options);
      Vec3 before = Vec3::Zero(), before_accel = Vec3::Zero();
      for (int i = 0; i < kReadings; ++i) {
        const ImuReading reading = sensor.read(i / options.rate_hz, {}, at_rest());
        const Vec3 gyro = reading.sample.angular_velocity_radps;
        const Vec3 accel = reading.sample.specific_force_mps2;
        if (i == 0) {
          gyro_bias += reading.gyro_bias_radps.squaredNorm();
          accel_bias += reading.accel_bias_mps2.squaredNorm();
          const Vec3 off = accel - reading.accel_bias_mps2 + kGravity_world;
          gain += off.squaredNorm();
        } else {
          gyro_sum += (gyro - before).squaredNorm() / 2;
          accel_sum += (accel - before_accel).squaredNorm() / 2;
          n += 3;
        }
        before = gyro;
        before_accel = accel;
      }
    }
    const double root = std::sqrt(options.rate_hz);
    const auto rms = [](double sum, int count) { return std::sqrt(sum / count); };
    const double rounding_gyro = m.gyro_step_radps / std::sqrt(12);
    const double rounding_accel = m.accel_step_mps2 / std::sqrt(12);
    const double gyro = std::hypot(m.noise.gyro_noise_radps_sqrthz * root, rounding_gyro);
    const double accel = std::hypot(m.noise.accel_noise_mps2_sqrthz * root, rounding_accel);
    EXPECT_NEAR(rms(gyro_sum, n) / gyro, 1, 0.03) << name;
    EXPECT_NEAR(rms(accel_sum, n) / accel, 1, 0.03) << name;
    const double share = options.uncalibrated_share;
    EXPECT_NEAR(rms(gyro_bias, 3 * kSensors) / (share * m.gyro_offset_radps), 1, 0.1) << name;
    EXPECT_NEAR(rms(accel_bias, 3 * kSensors) / (share * m.accel_offset_mps2), 1, 0.1) << name;
    // Scale on the axis along gravity, misalignment on the two others.
    const double expected = 3 * accel * accel + std::pow(share * kStandardGravity_mps2, 2) *
                                                    (std::pow(m.accel_scale, 2) +
                                                     2 * std::pow(m.accel_misalignment_rad, 2));
    EXPECT_NEAR(gain / kSensors / expected, 1, 0.15) << name;
  }
}

TEST(ImuSensor, BiasesWanderWithTheRootOfTime) {
  ImuOptions options = options_of("BMI085");
  options.model.noise.gyro_walk_radps2_sqrthz = 1e-3;
  options.model.noise.accel_walk_mps3_sqrthz = 2e-2;
  double gyro = 0, accel = 0;
  constexpr int kSensors = 200, kSeconds = 4;
  for (options.seed = 1; options.seed <= kSensors; ++options.seed) {
    ImuSensor sensor(options);
    const ImuReading first = sensor.read(0, {}, at_rest());
    ImuReading last = first;
    for (int i = 0; i < kSeconds * options.rate_hz; ++i) last = sensor.read(0, {}, at_rest());
    gyro += (last.gyro_bias_radps - first.gyro_bias_radps).squaredNorm();
    accel += (last.accel_bias_mps2 - first.accel_bias_mps2).squaredNorm();
  }
  EXPECT_NEAR(gyro / (3 * kSensors * kSeconds) / 1e-6, 1, 0.2);
  EXPECT_NEAR(accel / (3 * kSensors * kSeconds) / 4e-4, 1, 0.2);
}

TEST(ImuSensor, ReadingsStopAtTheRangeAndHaveSteps) {
  const ImuOptions options = options_of("BMI055");
  ImuSensor sensor(options);
  TrueMotion wild;
  wild.angular_velocity_radps = Vec3(30, -30, 1);
  wild.specific_force_mps2 = Vec3(-90, 90, 9.8);
  const ImuSample sample = sensor.read(0, {}, wild).sample;
  EXPECT_EQ(sample.angular_velocity_radps.x(), options.model.gyro_range_radps);
  EXPECT_EQ(sample.angular_velocity_radps.y(), -options.model.gyro_range_radps);
  EXPECT_EQ(sample.specific_force_mps2.x(), -options.model.accel_range_mps2);
  EXPECT_EQ(sample.specific_force_mps2.y(), options.model.accel_range_mps2);
  const double digits = sample.specific_force_mps2.z() / options.model.accel_step_mps2;
  EXPECT_NEAR(digits, std::round(digits), 1e-6);
}

TEST(ImuSensor, ATimeOffsetMovesTheStampsAndNothingElse) {
  const CameraPath path = path_of("walking_rpy");
  ImuOptions options = options_of("BMI085");
  const auto plain = imu_readings(path, options, {1'000'000'000'000}, 2, 3);
  options.time_offset_s = 0.0123;
  const auto late = imu_readings(path, options, {1'000'000'000'000}, 2, 3);
  ASSERT_EQ(plain.size(), 201U);
  ASSERT_EQ(late.size(), plain.size());
  EXPECT_EQ(plain[0].sample.stamp.ns, 1'002'000'000'000);
  for (std::size_t i = 0; i < plain.size(); ++i) {
    EXPECT_EQ(late[i].sample.stamp.ns - plain[i].sample.stamp.ns, 12'300'000);
    EXPECT_EQ(late[i].t_s, plain[i].t_s);
    EXPECT_EQ(late[i].sample.angular_velocity_radps, plain[i].sample.angular_velocity_radps);
    EXPECT_EQ(late[i].sample.specific_force_mps2, plain[i].sample.specific_force_mps2);
  }
}

TEST(ImuSensor, RepeatsWithOneSeedAndDiffersWithAnother) {
  const CameraPath path = path_of("walking_xyz");
  ImuOptions options = options_of("ICM-42688");
  const auto first = imu_readings(path, options, {}, 0, 0.5);
  const auto again = imu_readings(path, options, {}, 0, 0.5);
  options.seed = 2;
  const auto other = imu_readings(path, options, {}, 0, 0.5);
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].sample.specific_force_mps2, again[i].sample.specific_force_mps2);
    EXPECT_EQ(first[i].sample.angular_velocity_radps, again[i].sample.angular_velocity_radps);
    EXPECT_NE(first[i].sample.specific_force_mps2, other[i].sample.specific_force_mps2);
  }
}

TEST(ImuModels, AreFoundByNameAndTheIdealOneErrsInNothing) {
  EXPECT_EQ(find_imu_model("BMI999"), nullptr);
  EXPECT_EQ(find_imu_model(""), nullptr);
  for (const ImuModel& model : imu_models()) EXPECT_EQ(find_imu_model(model.name), &model);
  ImuSensor ideal(options_of("ideal"));
  TrueMotion motion;
  motion.angular_velocity_radps = Vec3(50, -1e-7, 3);
  motion.specific_force_mps2 = Vec3(-300, 0.1, 9.8);
  const ImuSample sample = ideal.read(0, {}, motion).sample;
  EXPECT_EQ(sample.angular_velocity_radps, motion.angular_velocity_radps);
  EXPECT_EQ(sample.specific_force_mps2, motion.specific_force_mps2);
}

}  // namespace
}  // namespace ygslam::sim
