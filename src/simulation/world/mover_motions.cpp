#include "simulation/world/mover_motions.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace ygslam::sim {

namespace {

/// The station before t and how far the motion to the next has come.
struct Leg {
  std::size_t from, to;
  double share;
};

Leg leg_at(const std::vector<Waypoint>& stations, double t_s) {
  if (t_s <= stations.front().t_s) return {0, 0, 0};
  for (std::size_t i = 0; i + 1 < stations.size(); ++i) {
    if (t_s < stations[i + 1].t_s) {
      return {i, i + 1, ease((t_s - stations[i].t_s) / (stations[i + 1].t_s - stations[i].t_s))};
    }
  }
  return {stations.size() - 1, stations.size() - 1, 0};
}

Waypoint between(const std::vector<Waypoint>& stations, double t_s) {
  const Leg leg = leg_at(stations, t_s);
  const Waypoint& a = stations[leg.from];
  const Waypoint& b = stations[leg.to];
  return {t_s, a.at + leg.share * (b.at - a.at), a.yaw_deg + leg.share * (b.yaw_deg - a.yaw_deg)};
}

}  // namespace

double ease(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (10 + x * (6 * x - 15));
}

SE3 placed(const Vec3& at, double yaw_deg) {
  return {so3_exp(Vec3(0, 0, yaw_deg * std::numbers::pi / 180)), at};
}

RigidMotion path_motion(std::vector<Waypoint> stations) {
  return [stations = std::move(stations)](double t_s) {
    const Waypoint here = between(stations, t_s);
    return placed(here.at, here.yaw_deg);
  };
}

RigidMotion rolling_motion(std::vector<Waypoint> stations, double radius_m) {
  return [stations = std::move(stations), radius_m](double t_s) {
    const Leg leg = leg_at(stations, t_s);
    Mat3 R = Mat3::Identity();
    Vec3 at = stations.front().at;
    for (std::size_t i = 0; i < stations.size() && i <= leg.from; ++i) {
      const std::size_t next = i < leg.from ? i + 1 : leg.to;
      const double share = i < leg.from ? 1 : leg.share;
      const Vec3 way = share * (stations[next].at - stations[i].at);
      at += way;
      R = so3_exp(Vec3::UnitZ().cross(way) / radius_m) * R;
    }
    return SE3(R, at);
  };
}

RigidMotion hinge_motion(std::vector<Waypoint> stations) {
  return [stations = std::move(stations)](double t_s) {
    return placed(stations.front().at, between(stations, t_s).yaw_deg);
  };
}

}  // namespace ygslam::sim
