#include "inertial/imu_health.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

constexpr double kOverRange = 1.1;               // what calibration adds to a clipped reading
constexpr double kAnyGyro_radps = 80;            // 4000 deg/s and some more
constexpr double kAnyAccel_mps2 = 40 * 9.80665;  // g
constexpr double kFarGyro_radps = 3;             // 15 mrad or ...
constexpr double kFarAccel_mps2 = 15;            // ... 75 mm/s in one reading at 200 Hz
constexpr double kNeighboursDiffer = 0.25;       // at most, for the distance to both
constexpr double kHangs_s = 0.05;
constexpr int kFewestRepeats = 5;
constexpr double kUsualRuns = 4;
constexpr double kRunMemory = 0.1;
// In units of the noise: at twice it a reading in the middle of its step is the same as the one
// before in 0.3 of all cases on all three axes, ten times in 1e-5.
constexpr double kCoarse = 2;

bool is_within(const Vec3& v, double told, double any) {
  return (v.array().abs() <= (told > 0 ? kOverRange * told : any)).all();
}

bool is_far_alone(const Vec3& reading, const Vec3& before, const Vec3& after, double far) {
  const double least = std::min((reading - before).norm(), (reading - after).norm());
  return least > far && (after - before).norm() < kNeighboursDiffer * least;
}

}  // namespace

bool is_beyond_range(const ImuSample& sample, const ImuRange& range) {
  return !is_within(sample.angular_velocity_radps, range.gyro_radps, kAnyGyro_radps) ||
         !is_within(sample.specific_force_mps2, range.accel_mps2, kAnyAccel_mps2);
}

bool is_far(const ImuSample& reading, const ImuSample& before) {
  return (reading.angular_velocity_radps - before.angular_velocity_radps).norm() > kFarGyro_radps ||
         (reading.specific_force_mps2 - before.specific_force_mps2).norm() > kFarAccel_mps2;
}

bool is_far_alone(const ImuSample& reading, const ImuSample& before, const ImuSample& after) {
  return is_far_alone(reading.angular_velocity_radps, before.angular_velocity_radps,
                      after.angular_velocity_radps, kFarGyro_radps) ||
         is_far_alone(reading.specific_force_mps2, before.specific_force_mps2,
                      after.specific_force_mps2, kFarAccel_mps2);
}

bool RepeatedReading::add(const Vec3& reading, double period_s) {
  if (last_ && reading == *last_) {
    ++run_;
    return hangs(period_s);
  }
  if (last_) {
    for (const double step : Vec3((reading - *last_).cwiseAbs()))
      if (step > 0) resolution_ = std::min(resolution_, step);
    if (!hangs(period_s)) usual_run_ += kRunMemory * (run_ - usual_run_);
  }
  last_ = reading;
  run_ = 1;
  return false;
}

bool RepeatedReading::hangs(double period_s) const {
  const double most =
      std::max({static_cast<double>(kFewestRepeats), kHangs_s / period_s, kUsualRuns * usual_run_});
  return run_ > most && resolution_ < kCoarse * noise_std_;
}

}  // namespace ygslam
