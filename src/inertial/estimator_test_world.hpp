// A camera with an IMU along a smooth motion, frame by frame: for tests of the estimator.
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <functional>
#include <optional>
#include <vector>

#include "inertial/inertial_estimator.hpp"
#include "inertial/inertial_test_world.hpp"

namespace ygslam::inertial_world {

struct DriveOptions {
  std::uint64_t seed = 0;
  double liveliness = 1;
  double seen_position_m = 0.002;
  double seen_rotation_rad = 0.1 * std::numbers::pi / 180;
  double offset_s = 0;  ///< the IMU's clock is late by
  std::optional<double> told_offset_s{};
  ImuNoise noise{};
  double gyro_scale_error = 0;  ///< that the estimator is told of
  /// What an IMU may do wrong; false: the sample is lost.
  std::function<bool(ImuSample&)> distort{};
};

class Drive {
 public:
  explicit Drive(const DriveOptions& options)
      : options_(options),
        motion_(options.seed, options.liveliness),
        rng_(1000 + options.seed),
        imu_(options.noise, some_bias(rng_), 2000 + options.seed),
        T_camera_imu_(some_mounting(rng_)),
        T_odom_world_((motion_.T_world_imu(0) * T_camera_imu_.inverse()).inverse()),
        estimator_(config()) {}

  static constexpr double kFrame_s = 1.0 / 30;

  /// One frame on, after the samples before it. @param seen whether it has a pose.
  void step(bool seen = true) {
    advance();
    estimator_.add_frame(now(), seen ? std::optional(seen_pose()) : std::nullopt);
  }
  /// The same without the frame.
  void advance() {
    now_s_ += kFrame_s;
    feed_samples();
    if (before_frame) before_frame(*this);
  }
  void run(double seconds, bool seen = true) {
    const int frames = static_cast<int>(std::lround(seconds / kFrame_s));
    for (int i = 0; i < frames; ++i) step(seen);
  }
  /// Called when the samples of a frame are there, and its pose is not.
  std::function<void(Drive&)> before_frame;

  [[nodiscard]] Timestamp now() const { return {to_ns(now_s_)}; }
  [[nodiscard]] InertialEstimator& estimator() { return estimator_; }
  [[nodiscard]] const ImuBias& true_bias() const { return imu_.bias(); }
  [[nodiscard]] Vec3 true_camera_bias_radps() const {
    return T_camera_imu_.R() * imu_.bias().gyro_radps;
  }
  [[nodiscard]] Vec3 true_gravity_odom() const { return T_odom_world_.R() * gravity_world(); }
  [[nodiscard]] SE3 true_pose() const { return true_pose(now_s_); }
  [[nodiscard]] SE3 true_pose(double t_s) const {
    return T_odom_world_ * motion_.T_world_imu(t_s) * T_camera_imu_.inverse();
  }
  [[nodiscard]] SE3 true_imu_pose() const { return T_odom_world_ * motion_.T_world_imu(now_s_); }
  [[nodiscard]] Vec3 true_velocity_odom() const {
    return T_odom_world_.R() * motion_.velocity(now_s_);
  }
  /// With errors as they are told.
  [[nodiscard]] VisualPose seen_pose() {
    Vec6 sigma;
    sigma << Vec3::Constant(options_.seen_position_m), Vec3::Constant(options_.seen_rotation_rad);
    Vec6 error;
    for (int i = 0; i < 6; ++i) error[i] = rng_.normal(0, sigma[i]);
    return {true_pose() * SE3::exp(error), sigma.cwiseAbs2().asDiagonal()};
  }

  /// Of a predicted pose: translation and rotation in its own axes.
  [[nodiscard]] Vec6 error_of(const PosePrediction& predicted) const {
    return (true_pose().inverse() * predicted.T_odom_camera).log();
  }
  [[nodiscard]] double nees_of(const PosePrediction& predicted) const {
    const Vec6 error = error_of(predicted);
    return error.dot(predicted.covariance.ldlt().solve(error));
  }

 private:
  static Vec3 gravity_world() { return {0, 0, -kStandardGravity_mps2}; }
  static ImuBias some_bias(Rng& rng) {
    return {normal_vector(rng, 0.008), normal_vector(rng, 0.1)};
  }
  static SE3 some_mounting(Rng& rng) {
    const Vec3 t = normal_vector(rng, 0.03);
    return {so3_exp(normal_vector(rng, 1)), t};
  }
  [[nodiscard]] InertialConfig config() const {
    InertialConfig config;
    config.noise = options_.noise;
    config.T_camera_imu = T_camera_imu_;
    config.time_offset_s = options_.told_offset_s;
    config.gyro_scale_error = options_.gyro_scale_error;
    config.tilt_walk_rad_sqrts = 1e-5;  // this vision does not drift
    return config;
  }
  void feed_samples() {
    const double period_s = 1 / options_.noise.rate_hz;
    while (next_sample_s_ <= now_s_ + 0.002) {
      ImuSample sample = imu_.measure(motion_.reading({to_ns(next_sample_s_)}, gravity_world()));
      sample.stamp.ns += to_ns(options_.offset_s);
      if (!options_.distort || options_.distort(sample)) estimator_.add(sample);
      next_sample_s_ += period_s;
    }
  }

  DriveOptions options_;
  SmoothMotion motion_;
  Rng rng_;
  NoisyImu imu_;
  SE3 T_camera_imu_, T_odom_world_;
  InertialEstimator estimator_;
  double now_s_ = 0, next_sample_s_ = -0.1;
};

inline constexpr std::uint64_t kSeeds = 20;
inline constexpr int kWindows = 3;

/// Of predictions at the end of stretches without vision.
struct Coasted {
  std::vector<double> error_m, nees, unseen_s;  ///< fewer where there was no prediction
  bool goes_on = true;                          ///< the estimator, when all is seen again
};

/// Without vision for so long, several times in each of kSeeds drives.
inline Coasted coasted(double seconds, DriveOptions options, int windows = kWindows) {
  Coasted result;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    options.seed = seed;
    Drive drive(options);
    drive.run(8);
    for (int window = 0; window < windows; ++window) {
      drive.run(seconds, false);
      if (const auto predicted = drive.estimator().predict(drive.now())) {
        result.error_m.push_back(drive.error_of(*predicted).head<3>().norm());
        result.nees.push_back(drive.nees_of(*predicted));
        result.unseen_s.push_back(predicted->unseen_s);
      }
      drive.run(3);
      result.goes_on = result.goes_on && drive.estimator().started();
    }
  }
  return result;
}

// 95 % of chi-square with 6 degrees of freedom lie between.
inline constexpr double kLeastNees = 1.24, kMostNees = 14.45;

[[nodiscard]] inline double share_within_bounds(const std::vector<double>& nees) {
  const auto count = std::ranges::count_if(
      nees, [](double value) { return value >= kLeastNees && value <= kMostNees; });
  return static_cast<double>(count) / static_cast<double>(nees.size());
}

}  // namespace ygslam::inertial_world
