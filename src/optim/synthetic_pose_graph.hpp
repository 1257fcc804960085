// Cameras walking laps of one circle, with odometry and loops of known noise and wrong loops of
// known kind: the oracle of the pose graph's tests and benchmarks.
#pragma once

#include <cmath>
#include <numbers>

#include "core/rng.hpp"
#include "optim/pose_graph.hpp"
#include "optim/synthetic_views.hpp"

namespace ygslam::synthetic {

struct Laps {
  int poses = 300;
  int laps = 3;
  double step_m = 0.25;
  int neighbours = 1;           ///< each pose is measured from this many before it
  int loops = 40;               ///< true ones, robust
  double odometry_m = 0.002;    ///< per metre between the two poses
  double odometry_rad = 0.001;  ///< per metre between the two poses
  double loop_m = 0.01;
  double loop_rad = 0.005;
};

struct PoseGraphWorld {
  PoseGraph graph;                  ///< at the sum of the odometry, first pose fixed at the truth
  std::vector<SE3> T_camera_world;  ///< the truth
  std::vector<std::uint8_t> is_wrong;  ///< per edge
  int poses_per_lap = 0;
};

[[nodiscard]] inline SE3 pose_on_lap(double angle, double radius_m) {
  const Vec3 p_world(radius_m * std::cos(angle), radius_m * std::sin(angle),
                     0.3 * std::sin(3 * angle));
  const Mat3 R_world_camera =
      so3_exp(angle * Vec3::UnitZ()) * so3_exp(Vec3(0.2 * std::sin(angle), 0.1, 0));
  return SE3(R_world_camera, p_world).inverse();
}

/// Full, of deviations about a millimetre and a milliradian.
[[nodiscard]] inline Mat6 random_information(Rng& rng) {
  Mat6 A;
  for (int i = 0; i < 36; ++i) A(i) = rng.normal();
  const Vec6 scale = (Vec6() << 300, 200, 100, 500, 800, 700).finished();
  return scale.asDiagonal() * (A * A.transpose() + Mat6::Identity()) * scale.asDiagonal();
}

/// The motion from one pose of the truth to another, disturbed as its information says.
[[nodiscard]] inline PoseGraphEdge measured_edge(const PoseGraphWorld& world, std::uint32_t from,
                                                 std::uint32_t to, double sigma_m, double sigma_rad,
                                                 Rng& rng) {
  PoseGraphEdge edge;
  edge.from = from, edge.to = to;
  edge.T_to_from = SE3::exp(random_twist(rng, sigma_m, sigma_rad)) * world.T_camera_world[to] *
                   world.T_camera_world[from].inverse();
  Vec6 information;
  information << Vec3::Constant(1 / (sigma_m * sigma_m)),
      Vec3::Constant(1 / (sigma_rad * sigma_rad));
  edge.information = information.asDiagonal();
  return edge;
}

inline void add_edge(PoseGraphWorld& world, const PoseGraphEdge& edge, bool is_wrong) {
  world.graph.edges.push_back(edge);
  world.is_wrong.push_back(is_wrong ? 1 : 0);
}

[[nodiscard]] inline PoseGraphWorld pose_graph_world(const Laps& laps, Rng& rng) {
  PoseGraphWorld world;
  world.poses_per_lap = laps.poses / laps.laps;
  const double turn = 2 * std::numbers::pi / world.poses_per_lap;
  for (int i = 0; i < laps.poses; ++i) {
    world.T_camera_world.push_back(pose_on_lap(turn * i, laps.step_m / turn));
  }
  PoseGraph& graph = world.graph;
  graph.T_camera_world = {world.T_camera_world[0]};
  graph.fixed.assign(laps.poses, 0);
  graph.fixed[0] = 1;
  for (std::uint32_t i = 1; i < static_cast<std::uint32_t>(laps.poses); ++i) {
    for (std::uint32_t k = 1; k <= std::min<std::uint32_t>(i, laps.neighbours); ++k) {
      const double way_m = k * laps.step_m;
      add_edge(
          world,
          measured_edge(world, i - k, i, way_m * laps.odometry_m, way_m * laps.odometry_rad, rng),
          false);
      if (k == 1) {
        graph.T_camera_world.push_back(graph.edges.back().T_to_from * graph.T_camera_world[i - 1]);
      }
    }
  }
  for (int i = 0; i < laps.loops; ++i) {
    const std::uint32_t lap = world.poses_per_lap;
    const std::uint32_t to = lap + 2 + rng.below(laps.poses - lap - 2);
    const std::uint32_t laps_back = 1 + rng.below((to - 2) / lap);
    const std::uint32_t from = to - lap * laps_back - 2 + rng.below(3);
    PoseGraphEdge edge = measured_edge(world, from, to, laps.loop_m, laps.loop_rad, rng);
    edge.robust = true;
    add_edge(world, edge, false);
  }
  return world;
}

/// Loops that claim anything at all.
inline void add_random_wrong_loops(PoseGraphWorld& world, int count, const Laps& laps, Rng& rng) {
  const auto poses = static_cast<std::uint32_t>(world.T_camera_world.size());
  for (int i = 0; i < count; ++i) {
    const std::uint32_t from = rng.below(poses - 20);
    const std::uint32_t to = from + 10 + rng.below(poses - from - 10);
    PoseGraphEdge edge = measured_edge(world, from, to, laps.loop_m, laps.loop_rad, rng);
    edge.T_to_from = SE3::exp(random_twist(rng, 3.0, 0.5));
    edge.robust = true;
    add_edge(world, edge, true);
  }
}

/// Loops that all claim the same: the places around `to` are those around `from`, moved by
/// shift_m. Two rooms alike look like this.
inline void add_coherent_wrong_loops(PoseGraphWorld& world, int count, std::uint32_t from,
                                     std::uint32_t to, const Vec3& shift_m, const Laps& laps,
                                     Rng& rng) {
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(count); ++i) {
    PoseGraphEdge edge = measured_edge(world, from + i, to + i, laps.loop_m, laps.loop_rad, rng);
    const SE3& T_from_world = world.T_camera_world[from + i];
    edge.T_to_from =
        edge.T_to_from * T_from_world * SE3(Mat3::Identity(), shift_m) * T_from_world.inverse();
    edge.robust = true;
    add_edge(world, edge, true);
  }
}

/// Root mean square distance of camera centres from the truth, without alignment.
[[nodiscard]] inline double position_error_m(const PoseGraphWorld& world,
                                             const std::vector<SE3>& T_camera_world) {
  double sum = 0;
  for (std::size_t i = 0; i < T_camera_world.size(); ++i) {
    sum += (T_camera_world[i].inverse().t() - world.T_camera_world[i].inverse().t()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(T_camera_world.size()));
}

}  // namespace ygslam::synthetic
