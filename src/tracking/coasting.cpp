#include "tracking/coasting.hpp"

#include <utility>

namespace ygslam {

std::vector<RetrackedFrame> Coasting::found_again(const KeyframeRelativePose& last,
                                                  Timestamp last_stamp, Timestamp now,
                                                  const SE3& T_now_last,
                                                  const SE3& T_predicted_last) {
  const SE3 T_last_now = T_now_last.inverse(), T_last_predicted = T_predicted_last.inverse();
  const Vec3 drift_last_m = T_last_now.t() - T_last_predicted.t();
  const Vec3 turn_rad = so3_log(T_last_predicted.R().transpose() * T_last_now.R());
  const double whole_s = seconds_between(now, last_stamp);
  std::vector<RetrackedFrame> placed;
  for (const Frame& frame : std::exchange(frames_, {})) {
    // A bias of the gyroscope turns in proportion to time; what is wrong with gravity or the
    // accelerometer moves with its square.
    const double share = seconds_between(frame.stamp, last_stamp) / whole_s;
    const SE3 T_last_frame = frame.T_now_last.inverse();
    const SE3 T_last_placed(T_last_frame.R() * so3_exp(share * turn_rad),
                            T_last_frame.t() + share * share * drift_last_m);
    placed.push_back(
        {frame.frame, {last.reference, T_last_placed.inverse() * last.T_camera_reference}});
  }
  return placed;
}

}  // namespace ygslam
