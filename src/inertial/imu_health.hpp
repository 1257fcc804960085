// Which readings of an IMU no living sensor gives.
#pragma once

#include <limits>
#include <optional>

#include "geometry/imu.hpp"

namespace ygslam {

/// Readings end here; 0: unknown.
struct ImuRange {
  double gyro_radps = 0, accel_mps2 = 0;
};

/// Where the range is unknown: more than any sensor of robots measures.
[[nodiscard]] bool is_beyond_range(const ImuSample& sample, const ImuRange& range);

/// So far from the one before that it may be wrong.
[[nodiscard]] bool is_far(const ImuSample& reading, const ImuSample& before);
/// Far from both its neighbours, which agree: jolts last for several readings.
[[nodiscard]] bool is_far_alone(const ImuSample& reading, const ImuSample& before,
                                const ImuSample& after);

/// The readings of one sensor that repeat to the last bit. Noise makes them differ, unless they are
/// coarser than it (text with few digits): then, and without noise, nothing is said.
class RepeatedReading {
 public:
  /// @param noise_std of one reading.
  explicit RepeatedReading(double noise_std) : noise_std_(noise_std) {}

  /// @return whether it hangs: the same for more than 50 ms. Drivers that repeat the value of a
  /// slow sensor between two of its readings are known by how often they usually do.
  bool add(const Vec3& reading, double period_s);

 private:
  [[nodiscard]] bool hangs(double period_s) const;

  double noise_std_;
  std::optional<Vec3> last_;
  int run_ = 1;           // the same so far
  double usual_run_ = 1;  // mean
  double resolution_ = std::numeric_limits<double>::infinity();
};

}  // namespace ygslam
