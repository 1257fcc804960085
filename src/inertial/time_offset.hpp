// By how much the clocks of a camera and an IMU differ: what the gyroscope and vision say of the
// same rotation is compared at shifted times.
#pragma once

#include <deque>
#include <optional>
#include <span>

#include "geometry/imu.hpp"

namespace ygslam {

/// How the IMU turned between two frames, as vision saw it.
struct SeenTurn {
  Timestamp from, to;
  Vec3 turn_imu_rad;  ///< logarithm of R_from_to, IMU's axes
};

struct TimeOffset {
  double offset_s = 0;  ///< an IMU's stamp less the camera's of the same instant
  double sigma_s = 0;
  /// Share of the seen rotation that the gyroscope explains at this offset, its bias left out: near
  /// 1 if both see the same.
  double explained = 0;
};

/// Least squares over offsets within `reach_s`, with a constant bias. @return nullopt if there was
/// too little rotation to tell, or none of the offsets fits best.
/// @param samples in order of time, of all turns and `reach_s` around them.
[[nodiscard]] std::optional<TimeOffset> estimate_time_offset(std::span<const SeenTurn> turns,
                                                             const std::deque<ImuSample>& samples,
                                                             double reach_s = 0.1);

/// The largest share of the seen rotation that the gyroscope explains at any offset within reach:
/// small where it turns otherwise. Turns are put together to some 0.2 s, since of single ones much
/// is vision's noise. @return 1 if there was too little rotation to tell.
[[nodiscard]] double most_explained(std::span<const SeenTurn> turns,
                                    const std::deque<ImuSample>& samples, double reach_s);

}  // namespace ygslam
