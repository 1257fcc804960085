// A smooth motion that is known in closed form, and what an IMU measures along it: for tests.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "core/rng.hpp"
#include "geometry/random_vector.hpp"
#include "geometry/so3_jacobian.hpp"
#include "inertial/preintegration.hpp"

namespace ygslam::inertial_world {

inline Vec3 normal_vector(Rng& rng, double sigma) {
  return {rng.normal(0, sigma), rng.normal(0, sigma), rng.normal(0, sigma)};
}

/// Sums of sines: of the position along each axis, and of the rotation vector.
class SmoothMotion {
 public:
  struct Wave {
    Vec3 amplitude, phase;
    double rate_hz = 0;
  };
  struct Value {
    Vec3 value = Vec3::Zero(), first = Vec3::Zero(), second = Vec3::Zero();
  };

  /// A camera in a hand. @param liveliness 0: it stands still, tilted somehow.
  explicit SmoothMotion(std::uint64_t seed, double liveliness = 1) {
    Rng rng(seed);
    const auto wave = [&](double amplitude, double rate_hz) {
      const Vec3 phase = random_in_box<3>(rng, {0, 0, 0}, {6.28, 6.28, 6.28});
      return Wave{liveliness * amplitude * normal_vector(rng, 1).cwiseMax(-2).cwiseMin(2), phase,
                  rate_hz * rng.uniform(0.8, 1.2)};
    };
    tilt_ = normal_vector(rng, 0.5).cwiseMax(-0.8).cwiseMin(0.8);
    position_ = {wave(0.3, 0.25), wave(0.05, 0.9), wave(0.008, 2.1)};
    rotation_ = {wave(0.25, 0.2), wave(0.06, 0.7), wave(0.015, 1.8)};
  }

  [[nodiscard]] SE3 T_world_imu(double t_s) const {
    return {so3_exp(rotation(t_s).value), position(t_s).value};
  }
  [[nodiscard]] Vec3 velocity(double t_s) const { return position(t_s).first; }
  [[nodiscard]] Vec3 angular_velocity(double t_s) const {
    const Value r = rotation(t_s);
    return so3_left_jacobian(r.value).transpose() * r.first;
  }
  /// @param gravity where things fall to, in the world [m/s2].
  [[nodiscard]] Vec3 specific_force(double t_s, const Vec3& gravity) const {
    return T_world_imu(t_s).R().transpose() * (position(t_s).second - gravity);
  }
  [[nodiscard]] ImuSample reading(Timestamp at, const Vec3& gravity) const {
    const double t_s = 1e-9 * static_cast<double>(at.ns);
    return {at, angular_velocity(t_s), specific_force(t_s, gravity)};
  }

 private:
  [[nodiscard]] static Value sum(const std::vector<Wave>& waves, double t_s) {
    Value total;
    for (const Wave& wave : waves) {
      const double w = 2 * std::numbers::pi * wave.rate_hz;
      for (int i = 0; i < 3; ++i) {
        const double angle = w * t_s + wave.phase[i];
        total.value[i] += wave.amplitude[i] * std::sin(angle);
        total.first[i] += wave.amplitude[i] * w * std::cos(angle);
        total.second[i] -= wave.amplitude[i] * w * w * std::sin(angle);
      }
    }
    return total;
  }
  [[nodiscard]] Value position(double t_s) const { return sum(position_, t_s); }
  [[nodiscard]] Value rotation(double t_s) const {
    Value r = sum(rotation_, t_s);
    r.value += tilt_;
    return r;
  }

  std::vector<Wave> position_, rotation_;
  Vec3 tilt_;
};

/// An IMU with noise and biases that walk.
class NoisyImu {
 public:
  NoisyImu(const ImuNoise& noise, const ImuBias& bias, std::uint64_t seed)
      : noise_(noise), bias_(bias), rng_(seed) {}

  /// The next reading, 1 / rate_hz after the one before.
  [[nodiscard]] ImuSample measure(ImuSample truth) {
    const double root_hz = std::sqrt(noise_.rate_hz);
    truth.angular_velocity_radps +=
        bias_.gyro_radps + normal_vector(rng_, noise_.gyro_noise_radps_sqrthz * root_hz);
    truth.specific_force_mps2 +=
        bias_.accel_mps2 + normal_vector(rng_, noise_.accel_noise_mps2_sqrthz * root_hz);
    bias_.gyro_radps += normal_vector(rng_, noise_.gyro_walk_radps2_sqrthz / root_hz);
    bias_.accel_mps2 += normal_vector(rng_, noise_.accel_walk_mps3_sqrthz / root_hz);
    return truth;
  }
  [[nodiscard]] const ImuBias& bias() const { return bias_; }

 private:
  ImuNoise noise_;
  ImuBias bias_;
  Rng rng_;
};

}  // namespace ygslam::inertial_world
