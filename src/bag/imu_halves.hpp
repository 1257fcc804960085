// Gyroscope and accelerometer that tell apart from each other, as those of a RealSense do.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "geometry/imu.hpp"

namespace ygslam {

/// The gyroscope's readings with accelerations between those of the accelerometer, while both come.
/// Of a half what is not newer than the last is left out; where it goes far back its clock was set,
/// and both begin anew.
class ImuHalves {
 public:
  static constexpr std::size_t kMostWaiting = 10'000;  ///< of a half, for the other

  void add_gyro(const ImuSample& sample);
  void add_accel(const ImuSample& sample);
  /// Those whose acceleration is known by now: none of a gap between accelerations, or before them.
  [[nodiscard]] std::vector<ImuSample> take();

 private:
  struct Half {
    std::deque<ImuSample> waiting;
    std::optional<Timestamp> last;  // that came
  };
  void add(Half& half, const ImuSample& sample);
  void settle();

  Half gyro_, accel_;
  std::vector<ImuSample> united_;
};

}  // namespace ygslam
