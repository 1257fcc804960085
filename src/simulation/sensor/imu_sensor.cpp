#include "simulation/sensor/imu_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/check.hpp"

namespace ygslam::sim {
namespace {

constexpr double kDifference_s = 0.002;
constexpr std::uint64_t kSeedOfImu = 0x696d75;  // nothing else draws from this stream

/// The value, or the nearest that the sensor can tell.
double as_told(double value, double range, double step) {
  if (step > 0) value = std::round(value / step) * step;
  return range > 0 ? std::clamp(value, -range, range) : value;
}

}  // namespace

TrueMotion true_motion(const Motion& T_world_imu, double t_s) {
  const SE3 now = T_world_imu(t_s);
  const SE3 before = T_world_imu(t_s - kDifference_s), after = T_world_imu(t_s + kDifference_s);
  const SE3 before2 = T_world_imu(t_s - 2 * kDifference_s),
            after2 = T_world_imu(t_s + 2 * kDifference_s);
  // Five-point differences (Abramowitz, Stegun 1964, table 25.2).
  const auto turn = [&](const SE3& other) { return so3_log(now.R().transpose() * other.R()); };
  TrueMotion out;
  out.T_world_imu = now;
  out.velocity_world_mps =
      (8 * (after.t() - before.t()) - (after2.t() - before2.t())) / (12 * kDifference_s);
  out.angular_velocity_radps =
      (8 * (turn(after) - turn(before)) - (turn(after2) - turn(before2))) / (12 * kDifference_s);
  const Vec3 acceleration =
      (16 * (after.t() + before.t()) - (after2.t() + before2.t()) - 30 * now.t()) /
      (12 * kDifference_s * kDifference_s);
  out.specific_force_mps2 =
      now.R().transpose() * (acceleration + Vec3(0, 0, kStandardGravity_mps2));
  return out;
}

SE3 default_imu_pose() {
  constexpr double kDegree = std::numbers::pi / 180;
  Mat3 R;         // columns: the IMU's axes in those of the camera (right, down, forward)
  R << 0, -1, 0,  //
      0, 0, -1,   //
      1, 0, 0;
  return {R * so3_exp(Vec3(0.5, -1.0, 0.7) * kDegree), Vec3(0.020, -0.006, -0.012)};
}

Vec3 ImuSensor::Triad::read(const Vec3& truth, Rng& rng) const {
  Vec3 value = gain * truth + bias;
  for (int i = 0; i < 3; ++i) value[i] = as_told(value[i] + rng.normal(0, sigma), range, step);
  return value;
}

void ImuSensor::Triad::wander(double dt_s, Rng& rng) {
  for (int i = 0; i < 3; ++i) bias[i] += rng.normal(0, walk * std::sqrt(dt_s));
}

Vec3 ImuSensor::drawn(double sigma) {
  Vec3 value;
  for (int i = 0; i < 3; ++i) value[i] = rng_.normal(0, sigma);
  return value;
}

Mat3 ImuSensor::drawn_gain(double scale, double misalignment) {
  Mat3 gain = Mat3::Identity();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      gain(row, column) += rng_.normal(0, row == column ? scale : misalignment);
  return gain;
}

ImuSensor::ImuSensor(const ImuOptions& options)
    : dt_s_(1 / options.rate_hz),
      time_offset_s_(options.time_offset_s),
      rng_(Rng(options.seed ^ kSeedOfImu).next()) {
  CHECK(options.rate_hz > 0, "readings need a rate");
  const ImuModel& m = options.model;
  const double left = options.uncalibrated_share;
  // A density times the root of the rate (Woodman 2007, "An introduction to inertial navigation").
  const double root = std::sqrt(options.rate_hz);
  gyro_ = {drawn_gain(left * m.gyro_scale, left * m.gyro_misalignment_rad),
           drawn(left * m.gyro_offset_radps),
           m.noise.gyro_noise_radps_sqrthz * root,
           m.noise.gyro_walk_radps2_sqrthz,
           m.gyro_range_radps,
           m.gyro_step_radps};
  accel_ = {drawn_gain(left * m.accel_scale, left * m.accel_misalignment_rad),
            drawn(left * m.accel_offset_mps2),
            m.noise.accel_noise_mps2_sqrthz * root,
            m.noise.accel_walk_mps3_sqrthz,
            m.accel_range_mps2,
            m.accel_step_mps2};
}

ImuReading ImuSensor::read(double t_s, Timestamp start, const TrueMotion& truth) {
  ImuReading out;
  out.t_s = t_s;
  out.truth = truth;
  out.gyro_bias_radps = gyro_.bias;
  out.accel_bias_mps2 = accel_.bias;
  out.sample.stamp = {start.ns + to_ns(t_s + time_offset_s_)};
  out.sample.angular_velocity_radps = gyro_.read(truth.angular_velocity_radps, rng_);
  out.sample.specific_force_mps2 = accel_.read(truth.specific_force_mps2, rng_);
  gyro_.wander(dt_s_, rng_);
  accel_.wander(dt_s_, rng_);
  return out;
}

std::vector<ImuReading> imu_readings(const CameraPath& path, const ImuOptions& options,
                                     Timestamp start, double from_s, double until_s) {
  ImuSensor sensor(options);
  std::vector<ImuReading> readings;
  const auto first = static_cast<std::int64_t>(std::floor(from_s * options.rate_hz));
  const auto last = static_cast<std::int64_t>(std::ceil(until_s * options.rate_hz));
  for (std::int64_t i = first; i <= last; ++i) {
    const double t_s = static_cast<double>(i) / options.rate_hz;
    const Motion motion = [&](double when_s) {
      return path.T_world_camera_felt(when_s, t_s) * options.T_camera_imu;
    };
    readings.push_back(sensor.read(t_s, start, true_motion(motion, t_s)));
  }
  return readings;
}

}  // namespace ygslam::sim
