// What inertial sensors and wheels measure.
#pragma once

#include <optional>

#include "core/time.hpp"
#include "geometry/se3.hpp"

namespace ygslam {

inline constexpr double kStandardGravity_mps2 = 9.80665;

/// One reading of an IMU, in its own frame.
struct ImuSample {
  Timestamp stamp;
  Vec3 angular_velocity_radps;
  Vec3 specific_force_mps2;  ///< acceleration without gravity's: +9.81 upwards in an IMU at rest
};

/// What an IMU adds to the truth (continuous-time model of Kalibr's IMU noise page).
struct ImuNoise {
  double rate_hz = 200;
  double gyro_noise_radps_sqrthz = 2.4e-4;  ///< white noise, density
  double accel_noise_mps2_sqrthz = 1.2e-3;
  double gyro_walk_radps2_sqrthz = 2e-5;  ///< random walk of the bias, density
  double accel_walk_mps3_sqrthz = 3e-4;
};

/// An IMU that is fixed to the camera, as far as one knows it.
struct ImuCalibration {
  SE3 T_camera_imu;
  ImuNoise noise;
  double gyro_range_radps = 0;  ///< readings stop here; 0 = unknown
  double accel_range_mps2 = 0;
  /// A stamp of the IMU minus that of the camera at the same instant; nullopt: unknown.
  std::optional<double> time_offset_s;
  bool rate_is_said = false;  ///< noise.rate_hz is no assumption
};

/// One pose of a robot's base in the frame of its own odometry.
struct OdometrySample {
  Timestamp stamp;
  SE3 T_odom_base;
};

/// The robot that carries the camera, as far as one knows it.
struct WheelCalibration {
  SE3 T_base_camera;        ///< of the camera's optical frame; the base has x ahead and z up
  double way_scale = 1;     ///< true way for a told one: the wheels' radius
  double turn_scale = 1;    ///< true turn for a told one: the distance between the wheels
  double way_noise = 2e-3;  ///< random error of the way [m/sqrt(m)], standard deviation
  double turn_noise =
      6e-3;  ///< of the heading [rad/sqrt(m)], and as much for each root of a radian
  double time_offset_s = 0;  ///< a stamp of the wheels minus that of the camera at the same instant
};

}  // namespace ygslam
