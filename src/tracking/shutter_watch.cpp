#include "tracking/shutter_watch.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

constexpr double kSure_s = 0.0015;         // standard deviation of a read-out time
constexpr double kSigmas = 3.0;            // that two must lie apart to differ ...
constexpr double kLeastSurplus_s = 0.003;  // ... and at least so far to be worth a word
constexpr double kRollsShare = 0.5;        // of a suspected read-out

}  // namespace

ShutterWatch::ShutterWatch(const Camera& camera)
    : camera_(camera),
      estimator_(camera, {CameraParameter::kReadout}),
      times_(shutter_times(camera.config())),
      suspected_{1e-3 * camera.config().suspected_colour_readout_ms,
                 1e-3 * camera.config().suspected_depth_readout_ms, 0},
      known_(camera.config().shutter_known) {}

/// Once the rows are seen to roll, those of the device that is suspected; otherwise what was found,
/// with depth as much longer than colour as it was.
ShutterTimes ShutterWatch::times_with(double readout_s) const {
  if (times_.is_global() && !suspected_.is_global() &&
      readout_s > kRollsShare * suspected_.colour_readout_s)
    return suspected_;
  ShutterTimes times = times_;
  times.depth_readout_s += readout_s - times.colour_readout_s;
  times.colour_readout_s = readout_s;
  return times;
}

std::optional<ShutterReport> ShutterWatch::step(const TrackedFrame& frame) {
  if (reported_) return std::nullopt;
  estimator_.add(frame);
  const auto estimate = estimator_.estimate();
  if (!estimate || estimate->parts < parts_wanted_ || estimate->std[0] > kSure_s)
    return std::nullopt;
  ShutterReport report{estimate->value[0], estimate->std[0], times_.colour_readout_s, !known_,
                       times_};
  const bool differs = std::abs(report.readout_s - report.in_use_s) >
                       std::max(kSigmas * report.std_s, kLeastSurplus_s);
  if (known_) {
    reported_ = differs;
  } else {
    estimator_.clear();  // what was seen with other times does not count
    parts_wanted_ *= 2;
    if (differs) report.times = times_ = times_with(report.readout_s);
  }
  return differs ? std::optional(report) : std::nullopt;
}

}  // namespace ygslam
