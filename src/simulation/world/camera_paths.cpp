#include "simulation/world/camera_paths.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/check.hpp"
#include "core/rng.hpp"

namespace ygslam::sim {

namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr double kFrame_s = 1.0 / 30;
constexpr double kFeltStep_s = 0.02;  // a body gives way within a few hundredths of a second

/// One excursion to both sides that starts and ends at rest; phase and value in -1..1.
double excursion(double phase) {
  return std::sin(kTwoPi * phase) * (1 - std::cos(kTwoPi * phase)) / 1.299;
}

/// Smallest x in [low, high] with measure(x) = target; measure must grow with x.
template <typename Measure>
double solve(double low, double high, double target, const Measure& measure) {
  for (int i = 0; i < 22; ++i) {
    const double middle = std::sqrt(low * high);
    (measure(middle) < target ? low : high) = middle;
  }
  return std::sqrt(low * high);
}

Vec3 catmull_rom(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, double t) {
  return 0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t * t +
                (3 * b - a - 3 * c + d) * t * t * t);
}

/// A quintic B-spline whose control points are the values themselves: four times differentiable,
/// and smooth over three steps to both sides (de Boor 1978, chapter XI).
template <typename Value>
auto on_spline(double x, double step, const Value& value_at) {
  const double first = std::floor(x / step);
  const double u = x / step - first;
  const double u2 = u * u, u3 = u2 * u, u4 = u3 * u, u5 = u4 * u;
  const std::array<double, 6> weights = {1 - 5 * u + 10 * u2 - 10 * u3 + 5 * u4 - u5,
                                         26 - 50 * u + 20 * u2 + 20 * u3 - 20 * u4 + 5 * u5,
                                         66 - 60 * u2 + 30 * u4 - 10 * u5,
                                         26 + 50 * u + 20 * u2 - 20 * u3 - 20 * u4 + 10 * u5,
                                         1 + 5 * u + 10 * u2 + 10 * u3 + 5 * u4 - 5 * u5,
                                         u5};
  auto sum = (weights[0] / 120 * value_at((first - 2) * step)).eval();
  for (int i = 1; i < 6; ++i)
    sum += weights[static_cast<std::size_t>(i)] / 120 * value_at((first - 2 + i) * step);
  return sum;
}

/// Table 1 of the paper; a walking person holds the camera at 0.8 m/s.
PathSpeed default_speed(PathKind kind) {
  switch (kind) {
    case PathKind::kStatic:
      return {0.282 / 24.83, 1.388};
    case PathKind::kXyz:
      return {5.791 / 28.83, 5.490};
    case PathKind::kRpy:
      return {2.698 / 30.61, 20.903};
    case PathKind::kHalfsphere:
      return {7.686 / 35.81, 18.267};
    case PathKind::kWalk:
      return {0.8, 0};
    case PathKind::kDrive:
      return {0.5, 0};
  }
  return {};
}

}  // namespace

SE3 look_at_pose(const Vec3& at, const Vec3& look_at) {
  const Vec3 forward = (look_at - at).normalized();
  const Vec3 right = forward.cross(Vec3::UnitZ()).normalized();
  Mat3 R;
  R << right, forward.cross(right), forward;
  return {R, at};
}

CameraPath::CameraPath(const CameraPathConfig& config)
    : config_(config), target_(config.speed.value_or(default_speed(config.kind))) {
  Rng rng(config.seed * 6364136223846793005ULL + 1442695040888963407ULL);
  for (int axis = 0; axis < 6; ++axis) {
    for (int k = 0; k < 7; ++k) {
      const double hz = 0.22 * std::pow(1.62, k) * rng.uniform(0.85, 1.15);
      const double size = axis < 3 ? 0.004 : 0.004;
      waves_[axis].push_back({size * std::pow(hz, -1.45), hz, rng.uniform(0, kTwoPi)});
    }
  }
  sway_translation_ = 0.7 * config.jerk;
  sway_rotation_ = 0.7 * config.jerk;
  if (config_.kind == PathKind::kWalk || config_.kind == PathKind::kDrive) {
    prepare_walk();
  } else {
    T_world_start_ = look_at_pose(config.at, config.look_at);
    calibrate();
  }
}

void CameraPath::calibrate() {
  const auto length_with = [&](double& parameter) {
    return [&](double value) {
      parameter = value;
      return measured_speed().translation_mps;
    };
  };
  const auto turning_with = [&](double& parameter) {
    return [&](double value) {
      parameter = value;
      return measured_speed().rotation_deg_per_s;
    };
  };
  const double sway_low = 1e-4;
  const double sway_high = 50;
  const bool has_jerk = config_.jerk > 0;
  switch (config_.kind) {
    case PathKind::kStatic:
      if (!has_jerk) return;
      sway_translation_ =
          solve(sway_low, sway_high, target_.translation_mps, length_with(sway_translation_));
      sway_rotation_ =
          solve(sway_low, sway_high, target_.rotation_deg_per_s, turning_with(sway_rotation_));
      return;
    case PathKind::kXyz:
      hz_ = solve(0.005, 3, target_.translation_mps, length_with(hz_));
      if (has_jerk)
        sway_rotation_ =
            solve(sway_low, sway_high, target_.rotation_deg_per_s, turning_with(sway_rotation_));
      return;
    case PathKind::kRpy:
      hz_ = solve(0.005, 3, target_.rotation_deg_per_s, turning_with(hz_));
      if (has_jerk)
        sway_translation_ =
            solve(sway_low, sway_high, target_.translation_mps, length_with(sway_translation_));
      return;
    case PathKind::kHalfsphere:
      hz_ = solve(0.005, 3, target_.translation_mps, length_with(hz_));
      turn_gain_ = solve(0.01, 3, target_.rotation_deg_per_s, turning_with(turn_gain_));
      return;
    case PathKind::kWalk:
    case PathKind::kDrive:
      return;
  }
}

SE3 CameraPath::base_xyz(double t_s) const {
  const double phase = hz_ * t_s;
  const int axis = static_cast<int>(phase) % 3;
  const Vec3 reach_m(0.40, 0.22, 0.35);  // right, down, forward
  Vec3 p_camera = Vec3::Zero();
  p_camera[axis] = reach_m[axis] * excursion(phase - std::floor(phase));
  return T_world_start_ * SE3(Mat3::Identity(), p_camera);
}

SE3 CameraPath::base_rpy(double t_s) const {
  const double phase = hz_ * t_s;
  const int axis = static_cast<int>(phase) % 3;
  const Vec3 reach_rad(0.42, 0.55, 0.60);  // pitch, yaw, roll in the camera's axes
  Vec3 omega = Vec3::Zero();
  omega[axis] = reach_rad[axis] * excursion(phase - std::floor(phase));
  return T_world_start_ * SE3(so3_exp(omega), Vec3::Zero());
}

SE3 CameraPath::base_halfsphere(double t_s) const {
  constexpr double kRadius_m = 0.5;
  const double azimuth = 1.05 * std::sin(kTwoPi * hz_ * t_s);
  const double elevation = 0.42 * std::sin(kTwoPi * 0.618 * hz_ * t_s);
  const auto turn = [](double a, double e) -> Mat3 {
    return so3_exp(Vec3(0, -a, 0)) * so3_exp(Vec3(-e, 0, 0));
  };
  // The camera looks through the centre of the sphere, so it is behind it.
  const Vec3 p_camera = turn(azimuth, elevation) * Vec3(0, 0, -kRadius_m) + Vec3(0, 0, kRadius_m);
  return T_world_start_ * SE3(turn(turn_gain_ * azimuth, turn_gain_ * elevation), p_camera);
}

void CameraPath::prepare_walk() {
  const std::vector<Vec3>& points = config_.waypoints;
  CHECK(points.size() >= 2, "a walk needs two waypoints");
  const int n = static_cast<int>(points.size());
  const auto at = [&](int i) {
    return config_.closed ? points[((i % n) + n) % n] : points[std::clamp(i, 0, n - 1)];
  };
  const int segments = config_.closed ? n : n - 1;
  constexpr int kSamples = 40;
  for (int i = 0; i < segments; ++i) {
    for (int k = 0; k < kSamples; ++k) {
      curve_.push_back(
          catmull_rom(at(i - 1), at(i), at(i + 1), at(i + 2), static_cast<double>(k) / kSamples));
    }
  }
  curve_.push_back(at(segments));
  curve_s_m_.push_back(0);
  for (std::size_t i = 1; i < curve_.size(); ++i) {
    curve_s_m_.push_back(curve_s_m_.back() + (curve_[i] - curve_[i - 1]).norm());
  }
}

Vec3 CameraPath::walk_point(double s_m) const {
  const double total = curve_s_m_.back();
  if (config_.closed) {
    s_m = std::fmod(s_m, total);
    if (s_m < 0) s_m += total;
  } else {
    s_m = std::clamp(s_m, 0.0, total);
  }
  const auto next = std::upper_bound(curve_s_m_.begin(), curve_s_m_.end() - 1, s_m);
  const auto i = static_cast<std::size_t>(next - curve_s_m_.begin());
  const double k = (s_m - curve_s_m_[i - 1]) / std::max(1e-9, curve_s_m_[i] - curve_s_m_[i - 1]);
  return (1 - k) * curve_[i - 1] + k * curve_[i];
}

Vec3 CameraPath::endless_point(double s_m) const {
  Vec3 point = walk_point(s_m);
  if (config_.closed) return point;
  const std::size_t n = curve_.size();
  const double beyond_m = std::max(0.0, s_m - curve_s_m_.back());
  if (s_m < 0) point += s_m * (curve_[1] - curve_[0]).normalized();
  if (beyond_m > 0) point += beyond_m * (curve_[n - 1] - curve_[n - 2]).normalized();
  return point;
}

/// Looking where one will be: the mean of several points ahead turns smoothly.
Vec3 CameraPath::walk_view(double s_m, const Vec3& here) const {
  Vec3 ahead = Vec3::Zero();
  constexpr int kLooks = 8;
  for (int i = 1; i <= kLooks; ++i) ahead += (walk_point(s_m + 0.25 * i) - here) / kLooks;
  if (!config_.closed && ahead.norm() < 0.3) {
    ahead = here - walk_point(s_m - 1.0);
  }
  return ahead;
}

SE3 CameraPath::base_walk(double t_s) const {
  const double s_m = target_.translation_mps * t_s;
  const Vec3 here = walk_point(s_m);
  const Vec3 ahead = walk_view(s_m, here);
  const double bob_m = config_.jerk * 0.012 * std::sin(kTwoPi * 1.8 * t_s);
  return look_at_pose(here + Vec3(0, 0, bob_m),
                      here + Vec3(ahead.x(), ahead.y(), -0.08 * ahead.head<2>().norm()));
}

SE3 CameraPath::base_walk_felt(double t_s) const {
  const Vec6 view = on_spline(t_s, kFeltStep_s, [&](double knot_s) {
    const double s_m = target_.translation_mps * knot_s;
    const Vec3 here = walk_point(s_m);
    // Who walks at the first image walked before it.
    return (Vec6() << (s_m < 0 ? endless_point(s_m) : here), walk_view(s_m, here)).finished();
  });
  const Vec3 here = view.head<3>();
  const Vec3 ahead = view.tail<3>();
  const double bob_m = config_.jerk * 0.012 * std::sin(kTwoPi * 1.8 * t_s);
  return look_at_pose(here + Vec3(0, 0, bob_m),
                      here + Vec3(ahead.x(), ahead.y(), -0.08 * ahead.head<2>().norm()));
}

double CameraPath::driven_m(double t_s) const {
  constexpr double kStand_s = 1, kRamp_s = 2;
  const double total = curve_s_m_.back();
  const double speed =
      config_.closed ? target_.translation_mps : std::min(target_.translation_mps, total / kRamp_s);
  // From standing to full speed along 10 x^3 - 15 x^4 + 6 x^5, which has no jerk at its ends.
  const auto way_m = [&](double since_s) {
    const double x = std::clamp(since_s / kRamp_s, 0.0, 1.0);
    const double ramp = x * x * x * x * (2.5 - 3 * x + x * x);
    return speed * (kRamp_s * ramp + std::max(0.0, since_s - kRamp_s));
  };
  if (config_.closed) return way_m(t_s - kStand_s);
  const double end_s = kStand_s + kRamp_s + total / speed;
  return t_s < end_s - kRamp_s ? way_m(t_s - kStand_s) : total - way_m(end_s - t_s);
}

SE3 CameraPath::base_drive(double t_s) const {
  constexpr double kStep_m = 0.1, kNear_m = 1e-3;
  const double s_m = driven_m(t_s);
  const auto at = [&](double place_m) -> Vec3 {
    return on_spline(place_m, kStep_m, [&](double knot_m) { return endless_point(knot_m); });
  };
  const Vec3 nose = at(s_m + kNear_m) - at(s_m - kNear_m);
  const Vec3 here = at(s_m);
  return look_at_pose(here, here + Vec3(nose.x(), nose.y(), -0.08 * nose.head<2>().norm()));
}

SE3 CameraPath::base(double t_s) const {
  switch (config_.kind) {
    case PathKind::kStatic:
      return T_world_start_;
    case PathKind::kXyz:
      return base_xyz(t_s);
    case PathKind::kRpy:
      return base_rpy(t_s);
    case PathKind::kHalfsphere:
      return base_halfsphere(t_s);
    case PathKind::kWalk:
      return base_walk(t_s);
    case PathKind::kDrive:
      return base_drive(t_s);
  }
  return T_world_start_;
}

SE3 CameraPath::sway(double t_s) const {
  Vec6 twist = Vec6::Zero();
  for (int axis = 0; axis < 6; ++axis) {
    for (const Wave& wave : waves_[axis]) {
      twist[axis] += wave.amplitude * std::sin(kTwoPi * wave.hz * t_s + wave.phase);
    }
  }
  return {so3_exp(sway_rotation_ * twist.tail<3>()), sway_translation_ * twist.head<3>()};
}

SE3 CameraPath::T_world_camera(double t_s) const {
  for (const Kidnap& kidnap : config_.kidnaps) {
    if (t_s >= kidnap.from_s && t_s < kidnap.until_s) {
      return look_at_pose(kidnap.at, kidnap.look_at) * sway(t_s);
    }
  }
  return in_hand(t_s);
}

SE3 CameraPath::T_world_camera_felt(double t_s, double within_s) const {
  for (const Kidnap& kidnap : config_.kidnaps) {
    if (within_s >= kidnap.from_s && within_s < kidnap.until_s)
      return look_at_pose(kidnap.at, kidnap.look_at) * sway(t_s);
  }
  return (config_.kind == PathKind::kWalk ? base_walk_felt(t_s) : base(t_s)) * sway(t_s);
}

PathSpeed CameraPath::measured_speed() const {
  const int steps = std::max(1, static_cast<int>(config_.seconds / kFrame_s));
  double length_m = 0;
  double angle_rad = 0;
  SE3 T_world_before = in_hand(0);
  for (int i = 1; i <= steps; ++i) {
    const SE3 T_world_now = in_hand(i * kFrame_s);
    length_m += (T_world_now.t() - T_world_before.t()).norm();
    angle_rad += (T_world_before.inverse() * T_world_now).angle();
    T_world_before = T_world_now;
  }
  const double duration_s = steps * kFrame_s;
  return {length_m / duration_s, angle_rad / duration_s * 180 / std::numbers::pi};
}

double CameraPath::length_m() const { return measured_speed().translation_mps * config_.seconds; }

}  // namespace ygslam::sim
