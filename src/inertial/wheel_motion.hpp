// How the camera moved between two instants, as its robot's wheels tell, and how far that is to be
// believed.
#pragma once

#include "geometry/imu.hpp"

namespace ygslam {

/// What wheels are off by for long: way and turn relative to the told ones, and the camera's place
/// on the robot, turned about its own axes [rad].
inline constexpr int kWheelErrors = 5;
using WheelErrors = Eigen::Matrix<double, kWheelErrors, 1>;
using WheelErrorMatrix = Eigen::Matrix<double, kWheelErrors, kWheelErrors>;
using ByWheelErrors = Eigen::Matrix<double, 6, kWheelErrors>;

/// Of the camera: T_before_after exp(error), translation first.
struct WheelMotion {
  SE3 T_before_after;
  Mat6 noise = Mat6::Zero();  ///< of what differs from step to step
  ByWheelErrors by_errors = ByWheelErrors::Zero();

  [[nodiscard]] Mat6 covariance(const WheelErrorMatrix& errors) const {
    return noise + by_errors * errors * by_errors.transpose();
  }
};

/// Adds up steps of the base. Planar noise grows with the way and the turn; that the floor is not
/// flat, and that a wheel may slide at rest, is in it.
class WheelSum {
 public:
  /// @param wheels must outlive it.
  explicit WheelSum(const WheelCalibration& wheels) : wheels_(&wheels) {}

  /// @param T_before_after of the base, as told. @param errors as known so far: taken out.
  void add(const SE3& T_before_after, double step_s, const WheelErrors& errors);
  [[nodiscard]] WheelMotion of_camera(const WheelErrors& errors) const;
  [[nodiscard]] double way_m() const { return way_m_; }

 private:
  const WheelCalibration* wheels_;
  SE3 T_first_base_;
  Mat6 noise_ = Mat6::Zero();
  Eigen::Matrix<double, 6, 2> by_scales_ = Eigen::Matrix<double, 6, 2>::Zero();
  double way_m_ = 0;
};

}  // namespace ygslam
