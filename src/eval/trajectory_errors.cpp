#include "eval/trajectory_errors.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <numeric>

#include "core/check.hpp"
#include "core/statistics.hpp"

namespace ygslam {
namespace {

// atan2 of sine and cosine: exact near 0 and near 180 degrees alike.
double angle_deg(const Mat3& R) {
  const Vec3 twice_sine_axis(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
  return std::atan2(0.5 * twice_sine_axis.norm(), 0.5 * (R.trace() - 1.0)) * 180.0 /
         std::numbers::pi;
}

void add_error(const SE3& F, PoseErrors& errors) {
  errors.trans_m.push_back(F.t().norm());
  errors.rot_deg.push_back(angle_deg(F.R()));
}

}  // namespace

Statistics summarize(std::span<const double> errors) {
  CHECK(!errors.empty());
  const auto n = static_cast<double>(errors.size());
  std::vector<double> sorted(errors.begin(), errors.end());
  std::sort(sorted.begin(), sorted.end());
  Statistics s;
  s.count = errors.size();
  s.mean = std::accumulate(sorted.begin(), sorted.end(), 0.0) / n;
  double squares = 0;
  double deviations = 0;
  for (const double e : sorted) {
    squares += e * e;
    deviations += (e - s.mean) * (e - s.mean);
  }
  s.rmse = std::sqrt(squares / n);
  s.std = std::sqrt(deviations / n);
  s.median = sorted_median(sorted);
  s.min = sorted.front();
  s.max = sorted.back();
  return s;
}

PoseErrors absolute_errors(const PosePairs& pairs) {
  PoseErrors errors;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    add_error(pairs.truth[i].T_world_camera.inverse() * pairs.estimate[i].T_world_camera, errors);
  }
  return errors;
}

IndexPairs frame_intervals(std::size_t count, std::size_t delta) {
  CHECK(delta >= 1);
  IndexPairs intervals;
  for (std::size_t i = 0; i + delta < count; ++i) intervals.emplace_back(i, i + delta);
  return intervals;
}

IndexPairs time_intervals(std::span<const StampedPose> poses, double delta_s, double tolerance_s) {
  if (poses.empty()) return {};
  std::vector<Timestamp> stamps;
  std::vector<Timestamp> targets;
  for (const StampedPose& pose : poses) {
    stamps.push_back(pose.stamp);
    targets.push_back({pose.stamp.ns + to_ns(delta_s)});
  }
  IndexPairs intervals;
  const auto nearest = nearest_stamps(targets, stamps);
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const std::size_t j = nearest[i];
    if (j > i && std::llabs(stamps[j].ns - targets[i].ns) <= to_ns(tolerance_s)) {
      intervals.emplace_back(i, j);
    }
  }
  return intervals;
}

double median_interval_s(std::span<const StampedPose> poses) {
  if (poses.size() < 2) return 0.0;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    intervals.push_back(seconds_between(poses[i].stamp, poses[i - 1].stamp));
  }
  return summarize(intervals).median;
}

PoseErrors relative_errors(const PosePairs& pairs, const IndexPairs& intervals) {
  PoseErrors errors;
  for (const auto& [i, j] : intervals) {
    const SE3 Q = pairs.truth[i].T_world_camera.inverse() * pairs.truth[j].T_world_camera;
    const SE3 P = pairs.estimate[i].T_world_camera.inverse() * pairs.estimate[j].T_world_camera;
    add_error(Q.inverse() * P, errors);
  }
  return errors;
}

}  // namespace ygslam
