// What an inertial sensor on a camera reads while the camera moves.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/rng.hpp"
#include "geometry/imu.hpp"
#include "simulation/sensor/imu_models.hpp"
#include "simulation/world/camera_paths.hpp"

namespace ygslam::sim {

/// A pose for every time, of a body with mass: twice differentiable.
using Motion = std::function<SE3(double t_s)>;

/// How a body moves at one instant. Angular velocity and specific force are in its own frame.
struct TrueMotion {
  SE3 T_world_imu;
  Vec3 velocity_world_mps = Vec3::Zero();
  Vec3 angular_velocity_radps = Vec3::Zero();
  Vec3 specific_force_mps2 = Vec3::Zero();
};

/// By differences of poses up to 4 ms away, of fourth order: of a motion of f Hz with the amplitude
/// A the acceleration errs by A (2 pi f)^6 / 90 * (2 ms)^4, a millionth of it at 5 Hz. Gravity is
/// 9.80665 m/s^2 against the world's z axis.
[[nodiscard]] TrueMotion true_motion(const Motion& T_world_imu, double t_s);

/// T_camera_imu of a rendered camera: the x axis looks forward, z up, turned by half a degree
/// to a degree about each, 2 cm beside the lens.
[[nodiscard]] SE3 default_imu_pose();

struct ImuOptions {
  ImuModel model;
  double rate_hz = 200;
  /// 1: the errors of the chip as it is sold. A camera's maker calibrates it; what is then left of
  /// offsets, scale and misalignment, a tenth, is our assumption.
  double uncalibrated_share = 0.1;
  double time_offset_s = 0;  ///< a stamp minus the true time
  SE3 T_camera_imu = default_imu_pose();
  std::uint64_t seed = 1;
};

/// A reading, and what it should have been.
struct ImuReading {
  double t_s = 0;  ///< the true time; the stamp has the time offset in it
  ImuSample sample;
  TrueMotion truth;
  Vec3 gyro_bias_radps = Vec3::Zero();  ///< without noise, scale and misalignment
  Vec3 accel_bias_mps2 = Vec3::Zero();
};

/// Adds a sensor's errors to the truth: reading by reading, `1 / rate_hz` apart.
class ImuSensor {
 public:
  explicit ImuSensor(const ImuOptions& options);

  /// @param start the camera's stamp at t_s = 0.
  [[nodiscard]] ImuReading read(double t_s, Timestamp start, const TrueMotion& truth);

 private:
  struct Triad {  // three axes of one kind
    Mat3 gain = Mat3::Identity();
    Vec3 bias = Vec3::Zero();
    double sigma = 0, walk = 0, range = 0, step = 0;
    [[nodiscard]] Vec3 read(const Vec3& truth, Rng& rng) const;
    void wander(double dt_s, Rng& rng);
  };
  [[nodiscard]] Vec3 drawn(double sigma);
  [[nodiscard]] Mat3 drawn_gain(double scale, double misalignment);

  double dt_s_, time_offset_s_;
  Rng rng_;
  Triad gyro_, accel_;
};

/// Readings from before `from_s` to after `until_s`, at multiples of 1 / rate_hz.
/// @param start the camera's stamp at t_s = 0.
[[nodiscard]] std::vector<ImuReading> imu_readings(const CameraPath& path,
                                                   const ImuOptions& options, Timestamp start,
                                                   double from_s, double until_s);

}  // namespace ygslam::sim
