// Where gravity points, how fast the camera goes and what the gyroscope is off by, from the first
// second of poses and samples. RGB-D poses are metric, so that all of it is linear; standing still
// is no special case.
#pragma once

#include <functional>
#include <span>
#include <variant>
#include <vector>

#include "inertial/imu_fault.hpp"
#include "inertial/inertial_window.hpp"

namespace ygslam {

/// How wrong an IMU may be before anything is known of it.
struct ImuBounds {
  double gyro_bias_sigma_radps = 0.03;  ///< data sheets say 0.5 to 5 deg/s at most
  double accel_bias_sigma_mps2 = 0.3;   ///< ... and 20 to 70 mg
  double most_gyro_bias_radps = 0.2;
  double most_accel_bias_mps2 = 1.5;
};

struct SeenFrame {
  Timestamp stamp;
  SeenPose pose;
};

/// What the IMU measured from frame i to frame i + 1, integrated with a bias.
using Integrate = std::function<Preintegration(std::size_t i, const ImuBias& bias)>;
/// @param frames at least 5, over a good part of a second.
/// @return the solved window of all frames, or why the IMU is not to be believed.
[[nodiscard]] std::variant<InertialWindow, ImuFault> start_window(std::span<const SeenFrame> frames,
                                                                  const Integrate& integrate,
                                                                  const StateWalk& walk,
                                                                  const ImuBounds& bounds);

}  // namespace ygslam
