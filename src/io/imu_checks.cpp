#include "io/imu_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

namespace ygslam {
namespace {

// Gravity within a factor of two is gravity: who carries a sensor does not shake it harder than
// that for half of the time.
constexpr double kLooseness = 2;
constexpr double kBlock_s = 0.2;  // hands tremble faster, and turn slower

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Lengths of vectors: their median, and how far others are from it, as a share of it.
struct Lengths {
  double median = 0, spread = 0;
};

Lengths lengths_of(std::span<const ImuSample> samples, Vec3 ImuSample::*vector) {
  std::vector<double> values;
  for (const ImuSample& sample : samples) values.push_back((sample.*vector).norm());
  const double median = median_of(values);
  for (double& value : values) value = std::abs(value - median);
  return {median, median > 0 ? median_of(std::move(values)) / median : 0};
}

bool is_about(double value, double expected) {
  return value > expected / kLooseness && value < expected * kLooseness;
}

std::string fault_of_gravity(double gravity) {
  if (is_about(gravity, kStandardGravity_mps2)) return {};
  if (is_about(gravity, 1))
    return fmt::format(
        "accelerations of {:.3g} at the median are in units of g; multiply them by 9.80665",
        gravity);
  if (is_about(gravity, 1000))
    return fmt::format(
        "accelerations of {:.4g} at the median are in thousandths of g; multiply them by "
        "0.00980665",
        gravity);
  if (gravity < 1 / kLooseness)
    return fmt::format(
        "accelerations of {:.3g} m/s^2 at the median have no gravity in them; raw readings are "
        "needed",
        gravity);
  return fmt::format("accelerations of {:.3g} m/s^2 at the median are not gravity's 9.81", gravity);
}

/// A stretch of readings as one.
struct Block {
  double t_s = 0;
  Vec3 up = Vec3::Zero();       // direction of the specific force
  Vec3 turning = Vec3::Zero();  // mean angular velocity
};

std::vector<Block> blocks_of(std::span<const ImuSample> samples) {
  std::vector<Block> blocks;
  for (std::size_t begin = 0; begin < samples.size();) {
    Block block;
    std::size_t end = begin;
    for (; end < samples.size(); ++end) {
      if (seconds_between(samples[end].stamp, samples[begin].stamp) >= kBlock_s) break;
      block.up += samples[end].specific_force_mps2;
      block.turning += samples[end].angular_velocity_radps;
    }
    const auto n = static_cast<double>(end - begin);
    block.turning /= n;
    block.t_s = seconds_between(samples[begin].stamp, samples.front().stamp);
    if (block.up.norm() > 0) blocks.push_back({block.t_s, block.up.normalized(), block.turning});
    begin = end;
  }
  return blocks;
}

/// How gravity turns in the sensor's frame, as the accelerometer sees it and as the gyroscope says.
struct Turning {
  double seen = 0, said = 0, common = 0;  // sums of squares and products [rad^2]

  /// What the gyroscope says has to be multiplied with.
  [[nodiscard]] double factor() const { return common / said; }
  [[nodiscard]] double correlation() const { return common / std::sqrt(seen * said); }
};

Turning turning_of(std::span<const Block> blocks) {
  Turning turning;
  for (std::size_t i = 1; i < blocks.size(); ++i) {
    const Block &a = blocks[i - 1], &b = blocks[i];
    const double dt_s = b.t_s - a.t_s;
    if (dt_s > 2 * kBlock_s) continue;  // readings are missing
    const Vec3 seen = b.up - a.up;
    const Vec3 said = -dt_s * (0.5 * (a.turning + b.turning)).cross(0.5 * (a.up + b.up));
    turning.seen += seen.squaredNorm();
    turning.said += said.squaredNorm();
    turning.common += seen.dot(said);
  }
  return turning;
}

/// At the median. @return nullopt of fewer than two.
std::optional<double> usual_step_s(std::span<const ImuSample> samples) {
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < samples.size(); ++i)
    steps_s.push_back(seconds_between(samples[i].stamp, samples[i - 1].stamp));
  return steps_s.empty() ? std::nullopt : std::optional(median_of(std::move(steps_s)));
}

}  // namespace

ImuDoubt doubt_about(std::span<const ImuSample> samples, bool has_gyro) {
  if (samples.empty()) return {};
  const Lengths force = lengths_of(samples, &ImuSample::specific_force_mps2);
  const Lengths turn = lengths_of(samples, &ImuSample::angular_velocity_radps);
  // Gravity is as steady as nothing else that a hand does.
  if (has_gyro && is_about(turn.median, kStandardGravity_mps2) &&
      !is_about(force.median, kStandardGravity_mps2) && turn.spread < force.spread) {
    return {
        "accelerations stand before angular velocities; `t wx wy wz ax ay az` is expected, or "
        "a header that names the columns",
        true};
  }
  if (std::string fault = fault_of_gravity(force.median); !fault.empty())
    return {std::move(fault), true};
  if (!has_gyro) return {};
  const Turning turning = turning_of(blocks_of(samples));
  constexpr double kEnough_rad2 = 0.04;  // some 10 degrees in all
  if (turning.seen < kEnough_rad2 || turning.said < kEnough_rad2) return {};
  constexpr double kDegree = std::numbers::pi / 180;
  if (is_about(turning.factor(), kDegree) && turning.correlation() > 0.6) {
    return {fmt::format("the gyroscope turns gravity {:.0f} times as far as the accelerometer sees "
                        "it: angular velocities in degrees; multiply them by pi / 180",
                        1 / turning.factor()),
            true};
  }
  // With the right axes what both see is what the gyroscope says; the rest is acceleration.
  const double expected = std::sqrt(std::min(1.0, turning.said / turning.seen));
  if (turning.said > 10 * kEnough_rad2 && turning.correlation() < 0.5 * expected) {
    return {
        "the gyroscope does not turn gravity as the accelerometer sees it (axes or signs that "
        "differ?)"};
  }
  return {};
}

bool is_sensors_interval(double step_s) {
  constexpr double kLeast_s = 1e-4, kMost_s = 0.2;
  return step_s >= kLeast_s && step_s <= kMost_s;
}

std::string fault_of_intervals(std::span<const ImuSample> samples) {
  const auto step_s = usual_step_s(samples);
  if (!step_s || is_sensors_interval(*step_s)) return {};
  return fmt::format("readings are {:.3g} s apart, which no inertial sensor's are", *step_s);
}

std::string doubt_about_rate(std::span<const ImuSample> samples, const ImuCalibration& imu) {
  constexpr double kMostFactor = 1.5;  // drivers leave some out
  const auto step_s = usual_step_s(samples);
  if (!imu.rate_is_said || !step_s) return {};
  const double factor = *step_s * imu.noise.rate_hz;
  if (factor > 1 / kMostFactor && factor < kMostFactor) return {};
  return fmt::format("rate_hz: {:g} is said of readings at {:.3g} Hz (another sensor's file?)",
                     imu.noise.rate_hz, 1 / *step_s);
}

}  // namespace ygslam
