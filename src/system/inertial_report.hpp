// What users are told of IMU and wheels: when they are of use, and why they are not. Nothing is
// told again and again.
#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "inertial/inertial_start.hpp"
#include "inertial/wheel_odometry.hpp"

namespace ygslam {

class InertialReport {
 public:
  // Their stamps tell whether they belong together.
  void reading(Timestamp stamp) { add(stamp, reading_times_); }
  void frame(Timestamp stamp) { add(stamp, frame_times_); }

  void imu_began(const Vec3& gravity_odom);
  void imu_dropped(ImuFault fault);
  void wheel_pose() { wheels_came_ = true; }
  void wheels_agree(const WheelOdometry& wheels);
  void wheels_dropped(WheelFault fault);
  // No frames come any more: of what nothing was told, why it was of no use.
  void finish_imu();
  void finish_wheels();

 private:
  struct Span {  // of stamps
    Timestamp first, last;
  };
  static void add(Timestamp stamp, std::optional<Span>& times) {
    if (!times) times = {stamp, stamp};
    times->first = std::min(times->first, stamp);
    times->last = std::max(times->last, stamp);
  }

  std::optional<Span> reading_times_, frame_times_;
  bool imu_was_told_of_ = false;
  bool imu_is_known_ = false;                   // told, and no fault told since
  std::map<ImuFault, std::size_t> imu_faults_;  // how often each
  std::set<WheelFault> wheel_faults_;           // told
  bool wheels_came_ = false;                    // a pose of theirs
  bool wheels_agree_ = false;                   // told, and not dropped since
};

}  // namespace ygslam
