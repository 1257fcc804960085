#include "inertial/camera_turn.hpp"

#include <cmath>

#include "inertial/inertial_estimator.hpp"

namespace ygslam {
namespace {

constexpr double kLongestStep_s = 0.25;    // between two frames of one path
constexpr double kMostTurnStd_rad = 3e-3;  // by all that readings may lack
constexpr double kMostPeriodsUnread = 2;

}  // namespace

CameraTurn camera_turn(const Preintegration& measured, const ImuBias& bias,
                       const SE3& T_camera_imu) {
  return {T_camera_imu.R() * so3_log(measured.corrected(bias).R),
          std::sqrt(measured.covariance().topLeftCorner<3, 3>().trace() / 3)};
}

std::optional<CameraTurn> InertialEstimator::turn(Timestamp from, Timestamp to) const {
  if (to <= from || seconds_between(to, from) > kLongestStep_s) return std::nullopt;
  if (samples_.samples().empty()) return std::nullopt;
  // Beyond the newest reading it is a guess, of a hand's motion.
  const double unread_s = seconds_between(to, samples_.samples().back().stamp);
  if (unread_s > kMostPeriodsUnread / config_.noise.rate_hz) return std::nullopt;
  const auto measured = samples_.between(from, to, ImuBias{});
  if (!measured || samples_.was_clipped(from, to)) return std::nullopt;
  const auto [turn_rad, readings_std_rad] = camera_turn(*measured, {}, config_.T_camera_imu);
  if (readings_std_rad > kMostTurnStd_rad) return std::nullopt;
  const auto rate_before = samples_.reading(from), rate_after = samples_.reading(to);
  const double by_clock =
      is_offset_precise() || !rate_before || !rate_after
          ? 0
          : offset_sigma_s() *
                (rate_after->angular_velocity_radps - rate_before->angular_velocity_radps).norm();
  // A wrong scale adds up while it turns one way, and goes again while it turns back: as noise of
  // single steps it would count for more than it is.
  const double by_noise = config_.noise.gyro_noise_radps_sqrthz * std::sqrt(measured->duration_s());
  return CameraTurn{turn_rad,
                    std::hypot(by_noise, config_.gyro_scale_error * turn_rad.norm(), by_clock)};
}

}  // namespace ygslam
