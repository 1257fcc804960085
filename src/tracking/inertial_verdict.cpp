#include "tracking/inertial_verdict.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace ygslam {
namespace {

constexpr double kLongestCoast_s = 8, kMostStd_m = 0.4;
// Chi-square of 6 degrees of freedom, 99.9 %, at twice the standard deviation: vision and map have
// errors that the covariance does not know.
constexpr double kAgrees = 4 * 22.5;
constexpr double kMapStd_m = 0.005, kMapStd_rad = 0.003;  // of the map between two places

Mat6 with_map_error(Mat6 covariance) {
  covariance.diagonal().head<3>().array() += kMapStd_m * kMapStd_m;
  covariance.diagonal().tail<3>().array() += kMapStd_rad * kMapStd_rad;
  return covariance;
}

/// @param error of T_odom_camera exp(error).
bool is_expected(const InertialPrediction& inertial, const Vec6& error) {
  return error.dot(with_map_error(inertial.covariance).ldlt().solve(error)) < kAgrees;
}

}  // namespace

double position_std_m(const InertialPrediction& inertial) {
  return std::sqrt(inertial.covariance.topLeftCorner<3, 3>().trace());
}

std::optional<InertialPrediction> while_certain(const std::optional<InertialPrediction>& inertial) {
  const double longest_s = inertial && inertial->by_wheels ? kLongestByWheels_s : kLongestCoast_s;
  if (!inertial || inertial->unseen_s > longest_s) return std::nullopt;
  return position_std_m(*inertial) < kMostStd_m ? inertial : std::nullopt;
}

InertialVerdict verdict_of(const std::optional<InertialPrediction>& inertial,
                           const std::optional<SE3>& T_camera_world, const SE3& T_guess_world) {
  if (!inertial) return {};
  return {
      inertial->trusted,
      T_camera_world && is_expected(*inertial, (T_guess_world * T_camera_world->inverse()).log()),
      position_std_m(*inertial)};
}

KeyframeMotion motion_by(const InertialPrediction& inertial, const SE3& T_now_last,
                         const KeyframeRelativePose& last) {
  return {last.reference, T_now_last * last.T_camera_reference,
          with_map_error(inertial.covariance)};
}

}  // namespace ygslam
