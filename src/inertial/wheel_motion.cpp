#include "inertial/wheel_motion.hpp"

namespace ygslam {
namespace {

constexpr double kFloorTilt_rad_sqrtm = 2e-3;  // pitch and roll of the robot on its way
constexpr double kFloorStep_m_sqrtm = 1e-3;
constexpr double kRest_m_sqrts = 3e-4, kRest_rad_sqrts = 3e-4;  // whatever the wheels say

double squared(double value) { return value * value; }

}  // namespace

void WheelSum::add(const SE3& T_before_after, double step_s, const WheelErrors& errors) {
  const Vec6 told = T_before_after.log();
  Vec6 way = Vec6::Zero(), turn = Vec6::Zero();
  way.head<3>() = wheels_->way_scale * (1 + errors[0]) * told.head<3>();
  turn.tail<3>() = wheels_->turn_scale * (1 + errors[1]) * told.tail<3>();
  const SE3 step = SE3::exp(way + turn);
  const double way_m = way.norm(), turn_rad = turn.norm();
  Vec6 variance;
  variance.head<2>().setConstant(squared(wheels_->way_noise) * way_m);
  variance[2] = squared(kFloorStep_m_sqrtm) * way_m;
  variance.segment<2>(3).setConstant(squared(kFloorTilt_rad_sqrtm) * way_m);
  variance[5] = squared(wheels_->turn_noise) * (way_m + turn_rad);
  variance.head<3>().array() += squared(kRest_m_sqrts) * step_s;
  variance.tail<3>().array() += squared(kRest_rad_sqrts) * step_s;

  const Mat6 adjoint = step.inverse().adjoint();
  noise_ = adjoint * noise_ * adjoint.transpose();
  noise_.diagonal() += variance;
  by_scales_ = (adjoint * by_scales_).eval();  // to first order in the step's own turn
  by_scales_.col(0) += way;
  by_scales_.col(1) += turn;
  T_first_base_ = (T_first_base_ * step).normalized();
  way_m_ += way_m;
}

WheelMotion WheelSum::of_camera(const WheelErrors& errors) const {
  const SE3 T_base_camera(wheels_->T_base_camera.R() * so3_exp(errors.tail<3>()),
                          wheels_->T_base_camera.t());
  const SE3 T_camera_base = T_base_camera.inverse();
  WheelMotion motion{.T_before_after = T_camera_base * T_first_base_ * T_base_camera};
  const Mat6 adjoint = T_camera_base.adjoint();
  motion.noise = adjoint * noise_ * adjoint.transpose();
  motion.by_errors.leftCols<2>() = adjoint * by_scales_;
  const Mat6 by_place = Mat6::Identity() - motion.T_before_after.inverse().adjoint();
  motion.by_errors.rightCols<3>() = by_place.rightCols<3>();
  return motion;
}

}  // namespace ygslam
