#include "tracking/shutter_watch.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "optim/residual.hpp"

namespace ygslam {
namespace {

constexpr double kSure_s = 0.0015;  // standard deviation of a read-out time
constexpr double kLeastDepth_m = 0.1;
constexpr double kDamping = 1e-6;
constexpr double kSigmas = 3.0;            // that two must lie apart to differ ...
constexpr double kLeastSurplus_s = 0.003;  // ... and at least so far to be worth a word

}  // namespace

ShutterWatch::ShutterWatch(const Camera& camera)
    : camera_(camera),
      estimator_(camera, {CameraParameter::kReadout}),
      times_(shutter_times(camera.config())),
      known_(camera.config().shutter_known) {}

std::optional<ShutterReport> ShutterWatch::step(const TrackedFrame& frame,
                                                const SE3& T_camera_world, const LocalView& view) {
  if (reported_) return std::nullopt;
  estimator_.add(frame, T_camera_world, view);
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

// A point seen t after the middle pulls at the pose as if it were exp(-t velocity) away; all of
// them together move it by what least squares makes of that, to be taken back.
ReadoutSensitivity ShutterWatch::sensitivity(const TrackedFrame& frame, const SE3& T_camera_world,
                                             const LocalView& view) const {
  ReadoutSensitivity sensitivity{times_.colour_readout_s, Vec6::Zero()};
  if (known_ || frame.read_out.body_velocity.isZero(0)) return sensitivity;
  Mat6 H = Mat6::Zero();
  Mat6 H_by_share = Mat6::Zero();
  for (std::size_t i = 0; i < frame.landmarks.size(); ++i) {
    const std::int32_t k = frame.landmarks[i] == kNoLandmark ? -1 : view.find(frame.landmarks[i]);
    if (k < 0) continue;
    const Feature& feature = frame.features->points[i];
    const Vec3 p_cam = T_camera_world * view.landmarks[static_cast<std::size_t>(k)].p_world;
    if (p_cam.z() < kLeastDepth_m) continue;
    Observation seen;
    seen.ideal_px = feature.ideal_px.cast<double>();
    const auto J = pose_jacobian(camera_, seen, p_cam);
    const Mat6 information = J.transpose() * J;
    H += information;
    H_by_share += ((feature.uv_px.y() + 0.5) / camera_.height() - 0.5) * information;
  }
  H.diagonal().array() += kDamping;
  const Vec6 twist = H.ldlt().solve(H_by_share * frame.read_out.body_velocity);
  if (twist.allFinite()) sensitivity.twist_per_s = twist;
  return sensitivity;
}

}  // namespace ygslam
