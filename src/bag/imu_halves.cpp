#include "bag/imu_halves.hpp"

#include <utility>

#include "bag/stamp_order.hpp"

namespace ygslam {
namespace {

constexpr double kMostAccelGap_s = 0.05;  // between accelerations that are interpolated

/// @param stamp between both.
Vec3 acceleration_at(Timestamp stamp, const ImuSample& before, const ImuSample& after) {
  const double share = static_cast<double>(stamp.ns - before.stamp.ns) /
                       static_cast<double>(after.stamp.ns - before.stamp.ns);
  return (1 - share) * before.specific_force_mps2 + share * after.specific_force_mps2;
}

}  // namespace

void ImuHalves::add_gyro(const ImuSample& sample) { add(gyro_, sample); }

void ImuHalves::add_accel(const ImuSample& sample) { add(accel_, sample); }

void ImuHalves::add(Half& half, const ImuSample& sample) {
  if (half.last && sample.stamp <= *half.last) {
    if (apart_s(sample.stamp, *half.last) <= kMostAccelGap_s) return;
    for (Half* each : {&gyro_, &accel_}) *each = {};
  }
  half.last = sample.stamp;
  half.waiting.push_back(sample);
  if (half.waiting.size() > kMostWaiting) half.waiting.pop_front();
  settle();
}

void ImuHalves::settle() {
  std::deque<ImuSample>& accels = accel_.waiting;
  for (; !gyro_.waiting.empty(); gyro_.waiting.pop_front()) {
    ImuSample sample = gyro_.waiting.front();
    while (accels.size() > 1 && accels[1].stamp <= sample.stamp) accels.pop_front();
    if (accels.empty() || accels.back().stamp < sample.stamp) return;  // what comes may be near
    const ImuSample& before = accels.front();
    if (before.stamp > sample.stamp) continue;
    if (before.stamp == sample.stamp) {
      sample.specific_force_mps2 = before.specific_force_mps2;
    } else {
      if (apart_s(before.stamp, accels[1].stamp) > kMostAccelGap_s) continue;
      sample.specific_force_mps2 = acceleration_at(sample.stamp, before, accels[1]);
    }
    united_.push_back(sample);
  }
}

std::vector<ImuSample> ImuHalves::take() { return std::exchange(united_, {}); }

}  // namespace ygslam
