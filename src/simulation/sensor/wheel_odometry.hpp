// What the wheels of a robot below the camera tell of its way.
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/imu.hpp"
#include "simulation/world/camera_paths.hpp"

namespace ygslam::sim {

/// A robot with two driven wheels on one axle, below the camera.
struct WheelOptions {
  double rate_hz = 50;
  double track_m = 0.35;        ///< from wheel to wheel
  double radius_error = 0.001;  ///< standard deviations, relative: of each wheel
  double track_error = 0.005;
  double slip_m = 0.001;      ///< of each wheel's way after a metre; grows with the root of the way
  double slips_per_100m = 0;  ///< a wheel spins: for 0.4 s it turns half as far again as it rolls
  std::uint64_t seed = 1;
};

struct WheelReadings {
  std::vector<OdometrySample> samples;  ///< from the identity on
  SE3 T_base_camera;  ///< at the first: base on the floor below, x where the camera looks, z up
  double way_m = 0;
  double sideways_m = 0;  ///< of the base; such wheels cannot go there, and do not feel it
  int slips = 0;
};

/// Poses as the robot adds them up, at multiples of 1 / rate_hz, from before from_s to after
/// until_s. @param start the camera's stamp at t_s = 0.
[[nodiscard]] WheelReadings wheel_readings(const CameraPath& path, const WheelOptions& options,
                                           Timestamp start, double from_s, double until_s);

}  // namespace ygslam::sim
