// Cameras looking at random points, with noise and outliers of known kind: the oracle of this
// folder's tests and benchmarks.
#pragma once

#include <cmath>
#include <numbers>

#include "core/rng.hpp"
#include "geometry/geometry_testing.hpp"
#include "geometry/random_vector.hpp"
#include "optim/local_bundle.hpp"
#include "optim/pose_only.hpp"

namespace ygslam::synthetic {

struct Noise {
  double pixel_px = 1.0;
  double inverse_depth = 0.004;      ///< [1/m]
  double wrong_pixel_share = 0;      ///< of the observations: anywhere in the image
  double wrong_depth_share = 0;      ///< of the observations: any depth
  double without_depth_share = 0.2;  ///< of the observations
};

[[nodiscard]] inline Camera camera() { return geometry_test::test_camera(); }

[[nodiscard]] inline Vec6 random_twist(Rng& rng, double translation_m, double rotation) {
  Vec6 twist;
  for (int i = 0; i < 3; ++i) twist[i] = rng.normal(0, translation_m);
  for (int i = 3; i < 6; ++i) twist[i] = rng.normal(0, rotation);
  return twist;
}

// Draws among the arguments of one call come in any order, see geometry/random_vector.hpp.

/// A point in front of the camera at the pose, 0.7 to 5 m away.
[[nodiscard]] inline Vec3 random_point(const Camera& camera, const SE3& T_camera_world, Rng& rng) {
  const double v_px = rng.uniform(0, camera.height() - 1.0);
  const Vec2 px(rng.uniform(0, camera.width() - 1.0), v_px);
  return T_camera_world.inverse() * camera.unproject(px, rng.uniform(0.7, 5.0));
}

/// What the camera at the pose measures of the point.
[[nodiscard]] inline Observation observe(const Camera& camera, const SE3& T_camera_world,
                                         const Vec3& p_world, const Noise& noise, Rng& rng) {
  const Vec3 p_cam = T_camera_world * p_world;
  Observation seen;
  seen.sigma_px = noise.pixel_px > 0 ? noise.pixel_px : 1.0;
  seen.ideal_px = camera.project(p_cam) + noise.pixel_px * random_normals<2>(rng);
  if (rng.uniform() < noise.wrong_pixel_share) {
    seen.ideal_px = {rng.uniform(0, camera.width() - 1.0), rng.uniform(0, camera.height() - 1.0)};
  }
  if (rng.uniform() < noise.without_depth_share) return seen;
  seen.depth_m = 1.0 / std::max(0.05, 1.0 / p_cam.z() + noise.inverse_depth * rng.normal());
  if (rng.uniform() < noise.wrong_depth_share) seen.depth_m = rng.uniform(0.5, 6.0);
  const double sigma = noise.inverse_depth > 0 ? noise.inverse_depth : 0.004;
  seen.sigma_depth_m = sigma * seen.depth_m * seen.depth_m;
  return seen;
}

struct PoseWorld {
  SE3 T_camera_world;
  std::vector<PoseObservation> observations;
};

[[nodiscard]] inline PoseWorld pose_world(int points, const Noise& noise, Rng& rng) {
  PoseWorld world;
  world.T_camera_world = SE3::exp(random_twist(rng, 1.0, 0.5));
  for (int i = 0; i < points; ++i) {
    const Vec3 p = random_point(camera(), world.T_camera_world, rng);
    world.observations.push_back({p, observe(camera(), world.T_camera_world, p, noise, rng)});
  }
  return world;
}

struct BundleWorld {
  BundleProblem problem;  ///< at the truth
  std::vector<SE3> T_camera_world;
  std::vector<Vec3> points_world;
};

/// Cameras on a gentle arc; each point seen from up to `views` consecutive ones. First pose fixed.
[[nodiscard]] inline BundleWorld bundle_world(int poses, int points, int views, const Noise& noise,
                                              Rng& rng) {
  BundleWorld world;
  const Camera cam = camera();
  for (int i = 0; i < poses; ++i) {
    Vec6 path;
    path << 0.12 * i, 0.03 * std::sin(0.7 * i), 0.02 * i, 0.01 * i, -0.03 * i, 0.01 * std::cos(i);
    world.T_camera_world.push_back(SE3::exp(path) * SE3::exp(random_twist(rng, 0.02, 0.01)));
    world.problem.poses.push_back({world.T_camera_world.back(), i == 0});
  }
  for (int k = 0; k < points; ++k) {
    const int first = static_cast<int>(rng.below(std::max(1, poses - views + 1)));
    const SE3& T = world.T_camera_world[std::min(poses - 1, first + views / 2)];
    const Vec3 p = random_point(cam, T, rng);
    world.points_world.push_back(p);
    for (int i = first; i < std::min(poses, first + views); ++i) {
      const SE3& T_i = world.T_camera_world[i];
      const Vec3 p_cam = T_i * p;
      if (p_cam.z() < 0.3 || !cam.contains(cam.project(p_cam))) continue;
      world.problem.observations.push_back({static_cast<std::uint32_t>(i),
                                            static_cast<std::uint32_t>(k),
                                            observe(cam, T_i, p, noise, rng)});
    }
  }
  world.problem.points_world = world.points_world;
  return world;
}

/// Cameras walking laps of a round room, a quarter of a metre between them, looking at the wall;
/// each sees about per_view of the points. Every place is seen again in each lap, as in a whole
/// map. First pose fixed.
[[nodiscard]] inline BundleWorld room_world(int poses, int laps, int points, int per_view,
                                            const Noise& noise, Rng& rng) {
  BundleWorld world;
  const Camera cam = camera();
  const double path_radius_m = 0.25 * poses / laps / (2 * std::numbers::pi);
  for (int k = 0; k < points; ++k) {
    const double angle = rng.uniform(-std::numbers::pi, std::numbers::pi);
    const double radius_m = path_radius_m + rng.uniform(1.8, 3.3);
    world.points_world.emplace_back(radius_m * std::cos(angle), radius_m * std::sin(angle),
                                    rng.uniform(-1.5, 1.5));
  }
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(poses); ++i) {
    const double angle = 2 * std::numbers::pi * laps * i / poses;
    const Vec3 forward(std::cos(angle), std::sin(angle), 0), down(0, 0, -1);
    Mat3 R_world_camera;
    R_world_camera << down.cross(forward), down, forward;
    const SE3 T_camera_world = SE3::exp(random_twist(rng, 0.1, 0.1)) *
                               SE3(R_world_camera, path_radius_m * forward + 0.2 * down).inverse();
    world.T_camera_world.push_back(T_camera_world);
    world.problem.poses.push_back({T_camera_world, i == 0});
    std::vector<std::uint32_t> visible;
    for (std::uint32_t k = 0; k < world.points_world.size(); ++k) {
      const Vec3 p_cam = T_camera_world * world.points_world[k];
      if (p_cam.z() > 0.3 && cam.contains(cam.project(p_cam))) visible.push_back(k);
    }
    const double share = per_view / std::max(1.0, static_cast<double>(visible.size()));
    for (const std::uint32_t k : visible) {
      if (rng.uniform() >= share) continue;
      world.problem.observations.push_back(
          {i, k, observe(cam, T_camera_world, world.points_world[k], noise, rng)});
    }
  }
  world.problem.points_world = world.points_world;
  return world;
}

/// Moves free poses and all points away from the truth.
inline void perturb(BundleProblem& problem, double translation_m, double rotation, double point_m,
                    Rng& rng) {
  for (BundlePose& pose : problem.poses) {
    const SE3 moved = SE3::exp(random_twist(rng, translation_m, rotation)) * pose.T_camera_world;
    if (!pose.fixed) pose.T_camera_world = moved;
  }
  for (Vec3& p : problem.points_world) {
    for (int axis = 2; axis >= 0; --axis) p[axis] += rng.normal(0, point_m);
  }
}

}  // namespace ygslam::synthetic
