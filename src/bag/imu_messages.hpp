// sensor_msgs/Imu, as in ros2/common_interfaces.
#pragma once

#include "bag/ros_messages.hpp"
#include "geometry/imu.hpp"

namespace ygslam::ros {

struct Imu {
  static constexpr const char* kType = "sensor_msgs/msg/Imu";
  Header header;
  Quaternion orientation;
  std::array<double, 9> orientation_covariance{-1};  ///< -1: there is none (REP 145)
  Vector3 angular_velocity;
  std::array<double, 9> angular_velocity_covariance{};
  Vector3 linear_acceleration;  ///< with gravity's, as ImuSample
  std::array<double, 9> linear_acceleration_covariance{};
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header, m.orientation, m.orientation_covariance, m.angular_velocity,
        m.angular_velocity_covariance, m.linear_acceleration, m.linear_acceleration_covariance);
  }
};

/// @param noise of one reading, for the covariances.
[[nodiscard]] Imu to_ros(const ImuSample& sample, const ImuNoise& noise, const std::string& frame);

}  // namespace ygslam::ros
