#include "inertial/turn_filter.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "geometry/smooth_turns.hpp"

namespace ygslam {
namespace {

// Squared, in units of what the points may be off by: where the gyroscope says more than that, its
// scale is wrong. The points win.
constexpr double kMostOff = 1;

}  // namespace

SE3 TurnFilter::step(const SE3& T_odom_camera, const Mat6& covariance,
                     const std::optional<HeldTurn>& turn) {
  const Mat3& R = T_odom_camera.R();
  const Mat3 seen = covariance.bottomRightCorner<3, 3>() +
                    kLeastTurnStd_rad * kLeastTurnStd_rad * Mat3::Identity();
  const Mat3 by_points = kLastingFactor * kLastingFactor * seen;
  const Eigen::LLT<Mat3> points(by_points);
  if (points.info() != Eigen::Success || !by_points.allFinite()) {
    restart();
    return {};
  }
  if (!last_ || !turn) {
    last_ = {R, Vec3::Zero(), by_points};
    return {};
  }
  const Mat3 R_before_here = so3_exp(turn->turn_rad);
  Vec3 off_rad =
      so3_log(R.transpose() * last_->R_odom_points * so3_exp(last_->off_rad) * R_before_here);
  Mat3 P = R_before_here.transpose() * last_->covariance * R_before_here;
  P.diagonal().array() += turn->std_rad * turn->std_rad;
  const double misfit = off_rad.dot(points.solve(off_rad));
  if (misfit > kMostOff) off_rad *= std::sqrt(kMostOff / misfit);
  const Mat3 points_share = (P + by_points).ldlt().solve(P).transpose();  // the Kalman gain
  off_rad -= points_share * off_rad;
  P -= points_share * P;
  last_ = {R, off_rad, 0.5 * (P + P.transpose())};
  // The points tell of rotation and place together: the place goes along as its error does.
  Vec6 off;
  off << covariance.topRightCorner<3, 3>() * seen.ldlt().solve(off_rad), off_rad;
  return SE3::exp(off);
}

}  // namespace ygslam
