#include "tracking/inertial_verdict.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/chi_square.hpp"

namespace ygslam {
namespace {

constexpr double kLongestCoast_s = 8, kMostStd_m = 0.4;
// Chi-square of 6 degrees of freedom, 99.9 %, at twice the standard deviation: vision and map have
// errors that the covariance does not know.
constexpr double kAgrees = 4 * kMostChiSquare6;
constexpr double kMapStd_m = 0.005, kMapStd_rad = 0.003;  // of the map between two places

constexpr double kPointsStdFactor = 3;  // a few points agree by chance, as on a white wall

Mat6 with_map_error(Mat6 covariance) {
  covariance.diagonal().head<3>().array() += kMapStd_m * kMapStd_m;
  covariance.diagonal().tail<3>().array() += kMapStd_rad * kMapStd_rad;
  return covariance;
}

/// @param error of T_odom_camera exp(error).
double chi_square(const Mat6& covariance, const Vec6& error) {
  return error.dot(with_map_error(covariance).ldlt().solve(error));
}

}  // namespace

double position_std_m(const PosePrediction& inertial) {
  return std::sqrt(inertial.covariance.topLeftCorner<3, 3>().trace());
}

std::optional<PosePrediction> while_certain(const std::optional<PosePrediction>& inertial) {
  const double longest_s = inertial && inertial->by_wheels ? kLongestByWheels_s : kLongestCoast_s;
  if (!inertial || inertial->unseen_s > longest_s) return std::nullopt;
  return position_std_m(*inertial) < kMostStd_m ? inertial : std::nullopt;
}

InertialVerdict verdict_of(const std::optional<PosePrediction>& inertial,
                           const std::optional<SeenCamera>& seen, const SE3& T_guess_world) {
  if (!inertial) return {};
  InertialVerdict verdict{inertial->trusted, false, position_std_m(*inertial)};
  if (!seen) return verdict;
  const SE3 T_guess_found = T_guess_world * seen->T_camera_world.inverse();
  const Vec6 error = T_guess_found.log();
  verdict.agrees = chi_square(inertial->covariance, error) < kAgrees;
  if (!inertial->agreed) return verdict;
  const Mat6 by_points = kPointsStdFactor * kPointsStdFactor * seen->covariance;
  verdict.nis = chi_square(inertial->covariance + by_points, error);
  if (const auto& earlier = inertial->earlier) {
    const SE3 T_odom_found = inertial->T_odom_camera * T_guess_found;
    verdict.earlier_nis = chi_square(earlier->covariance + by_points,
                                     (earlier->T_odom_camera.inverse() * T_odom_found).log());
  }
  return verdict;
}

bool camera_hangs(const RgbdFrame& now, const RgbdFrame& last, const SE3& T_now_last) {
  constexpr double kMoved_m = 0.01, kMoved_rad = 0.01;
  const bool moves = T_now_last.t().norm() > kMoved_m || T_now_last.angle() > kMoved_rad;
  return moves && now.grey.same_size(last.grey) &&
         std::equal(now.grey.data(), now.grey.data() + now.grey.size(), last.grey.data());
}

PosePrediction without_newest(PosePrediction inertial) {
  if (!inertial.earlier) return inertial;
  inertial.T_odom_camera = inertial.earlier->T_odom_camera;
  inertial.covariance = inertial.earlier->covariance;
  return inertial;
}

KeyframeMotion motion_by(const PosePrediction& inertial, const SE3& T_now_last,
                         const KeyframeRelativePose& last) {
  return {last.reference, T_now_last * last.T_camera_reference,
          with_map_error(inertial.covariance)};
}

}  // namespace ygslam
