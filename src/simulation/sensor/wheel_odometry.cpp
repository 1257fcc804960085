#include "simulation/sensor/wheel_odometry.hpp"

#include <array>
#include <cmath>

#include "core/check.hpp"
#include "core/rng.hpp"

namespace ygslam::sim {
namespace {

constexpr std::uint64_t kSeedOfWheels = 0x776865656c;
constexpr double kSlip_s = 0.4, kSlipShare = 0.5;

/// On the floor below the camera, x where it looks.
SE3 base_below(const SE3& T_world_camera) {
  const Vec3 forward = T_world_camera.R().col(2);
  const double yaw = std::atan2(forward.y(), forward.x());
  const Vec3& t = T_world_camera.t();
  return {so3_exp(Vec3(0, 0, yaw)), Vec3(t.x(), t.y(), 0)};
}

/// Both wheels, as the robot's program knows them.
class Wheels {
 public:
  explicit Wheels(const WheelOptions& options)
      : options_(options), rng_(Rng(options.seed ^ kSeedOfWheels).next()) {
    for (double& scale : scales_) scale = 1 + rng_.normal(0, options.radius_error);
    track_m_ = options.track_m * (1 + rng_.normal(0, options.track_error));
  }

  /// What the robot takes for its motion (a twist within the plane). @param twist the true one.
  [[nodiscard]] Vec6 told(const Vec6& twist) {
    begin_slip(std::abs(twist[0]));
    std::array<double, 2> ways_m{};
    for (std::size_t i = 0; i < 2; ++i) {
      const double side = i == 0 ? -0.5 : 0.5;  // left, right
      const double way_m = twist[0] + side * options_.track_m * twist[5];
      const double slip = slip_left_s_ > 0 && slipping_ == i ? kSlipShare : 0;
      ways_m[i] = way_m * scales_[i] * (1 + slip) +
                  rng_.normal(0, options_.slip_m * std::sqrt(std::abs(way_m)));
    }
    slip_left_s_ -= 1 / options_.rate_hz;
    Vec6 out = Vec6::Zero();
    out[0] = (ways_m[0] + ways_m[1]) / 2;
    out[5] = (ways_m[1] - ways_m[0]) / track_m_;
    return out;
  }
  [[nodiscard]] int slips() const { return slips_; }

 private:
  void begin_slip(double way_m) {
    if (slip_left_s_ > 0 || !(rng_.uniform() < options_.slips_per_100m / 100 * way_m)) return;
    slip_left_s_ = kSlip_s;
    slipping_ = rng_.below(2);
    ++slips_;
  }

  WheelOptions options_;
  Rng rng_;
  std::array<double, 2> scales_{};
  double track_m_ = 1;
  double slip_left_s_ = 0;
  std::size_t slipping_ = 0;
  int slips_ = 0;
};

}  // namespace

WheelReadings wheel_readings(const CameraPath& path, const WheelOptions& options, Timestamp start,
                             double from_s, double until_s) {
  CHECK(options.rate_hz > 0 && options.track_m > 0, "wheels need a rate and a distance");
  Wheels wheels(options);
  WheelReadings out;
  SE3 T_odom_base;
  const auto first = static_cast<std::int64_t>(std::floor(from_s * options.rate_hz));
  const auto last = static_cast<std::int64_t>(std::ceil(until_s * options.rate_hz));
  for (std::int64_t i = first; i <= last; ++i) {
    const double t_s = static_cast<double>(i) / options.rate_hz;
    const SE3 T_world_camera = path.T_world_camera_felt(t_s, t_s);
    const SE3 T_world_base = base_below(T_world_camera);
    if (i == first) out.T_base_camera = T_world_base.inverse() * T_world_camera;
    out.samples.push_back({{start.ns + to_ns(t_s)}, T_odom_base});
    const double next_s = static_cast<double>(i + 1) / options.rate_hz;
    const SE3 T_world_next = base_below(path.T_world_camera_felt(next_s, t_s));
    const Vec6 twist = (T_world_base.inverse() * T_world_next).log();
    out.way_m += twist.head<2>().norm();
    out.sideways_m += std::abs(twist[1]);
    T_odom_base = (T_odom_base * SE3::exp(wheels.told(twist))).normalized();
  }
  out.slips = wheels.slips();
  return out;
}

}  // namespace ygslam::sim
