#include "tracking/shutter_watch.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

constexpr double kSure_s = 0.0015;         // standard deviation of a read-out time
constexpr double kSigmas = 3.0;            // that two must lie apart to differ ...
constexpr double kLeastSurplus_s = 0.003;  // ... and at least so far to be worth a word

}  // namespace

ShutterWatch::ShutterWatch(const Camera& camera)
    : estimator_(camera, {CameraParameter::kReadout}),
      times_(shutter_times(camera.config())),
      known_(camera.config().shutter_known) {}

std::optional<ShutterReport> ShutterWatch::step(const TrackedFrame& frame) {
  if (reported_) return std::nullopt;
  estimator_.add(frame);
  const auto estimate = estimator_.estimate();
  if (!estimate || estimate->parts < parts_wanted_ || estimate->std[0] > kSure_s)
    return std::nullopt;
  ShutterReport report{estimate->value[0], estimate->std[0], times_.colour_readout_s, !known_};
  const bool differs = std::abs(report.readout_s - report.in_use_s) >
                       std::max(kSigmas * report.std_s, kLeastSurplus_s);
  if (known_) {
    reported_ = differs;
  } else {
    estimator_.clear();  // what was seen with other times does not count
    parts_wanted_ *= 2;
    if (differs) times_.colour_readout_s = times_.depth_readout_s = report.readout_s;
  }
  return differs ? std::optional(report) : std::nullopt;
}

}  // namespace ygslam
