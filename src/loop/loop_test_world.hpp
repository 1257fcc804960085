// A walk around a ring of points that drifts, mapped as a tracker would that never recognises a
// place: the oracle of the tests of loops.
#pragma once

#include <numbers>
#include <vector>

#include "map/map_test_world.hpp"

namespace ygslam::loop_test {

using map_test::SeenFrame;
using map_test::World;

struct Walk {
  int keyframes_per_lap = 48;
  int keyframes = 58;
  int first = 0;             ///< where on the lap it starts
  int torn_at = -1;          ///< this keyframe knows nothing of those before it; -1 = none
  int coasted_at = -1;       ///< nothing was seen between this keyframe and the one before
  double coasted_m = 0;      ///< and so far to the side it lies wrong, with all that follow
  double coasted_std_m = 0;  ///< as its motion says
  double drift_m = 0.2;      ///< at the end, grown evenly; along the x axis of the world
  double drift_rad = 0.03;   ///< the same, about the z axis of the world
};

/// Looks outwards from a circle of 1.5 m around the z axis.
inline SE3 ring_pose(double turns) {
  const double angle = 2 * std::numbers::pi * turns;
  const Vec3 forward(std::cos(angle), std::sin(angle), 0);
  Mat3 R_camera_world;
  R_camera_world.row(2) = forward;
  R_camera_world.row(1) = Vec3(0, 0, -1);
  R_camera_world.row(0) = Vec3(0, 0, -1).cross(forward);
  return {R_camera_world, R_camera_world * (-1.5 * forward)};
}

class RingWorld {
 public:
  explicit RingWorld(std::uint64_t seed, int points = 2500) : world_(points, seed) {
    Rng rng(seed + 1);
    for (auto& point : world_.points()) {
      const double angle = rng.uniform(0, 2 * std::numbers::pi);
      const double radius_m = rng.uniform(4, 6);
      point.p_world = {radius_m * std::cos(angle), radius_m * std::sin(angle),
                       rng.uniform(-1.5, 1.5)};
    }
  }

  /// From now on half a turn away everything looks the same.
  void repeat_half_a_turn_away() {
    auto& points = world_.points();
    const std::size_t half = points.size() / 2;
    for (std::size_t i = 0; i < half; ++i) {
      points[half + i] = points[i];
      points[half + i].p_world.head<2>() = -points[i].p_world.head<2>();
    }
  }

  [[nodiscard]] World& world() { return world_; }
  [[nodiscard]] const Camera& camera() const { return world_.camera(); }

  [[nodiscard]] static SE3 true_pose(const Walk& walk, int i) {
    return ring_pose(static_cast<double>(walk.first + i) / walk.keyframes_per_lap);
  }
  [[nodiscard]] static SE3 drifted_pose(const Walk& walk, int i) {
    const double share = static_cast<double>(i) / (walk.keyframes - 1);
    Vec6 drift;
    drift << share * walk.drift_m, 0, 0, 0, 0, share * walk.drift_rad;
    if (walk.coasted_at >= 0 && i >= walk.coasted_at) drift[2] += walk.coasted_m;
    return true_pose(walk, i) * SE3::exp(drift).inverse();
  }

  /// Points are followed from keyframe to keyframe; one that was out of view is a new landmark.
  [[nodiscard]] Map walk(const Walk& walk) {
    Map map({map_test::kLevels, map_test::kScale});
    for (int i = 0; i < walk.keyframes; ++i) {
      const bool is_root = i == 0 || i == walk.torn_at;
      const bool is_coasted = i == walk.coasted_at;
      add(map, i, true_pose(walk, i), drifted_pose(walk, i), !is_root, !is_root && !is_coasted);
      if (!is_coasted) continue;
      const SE3 T_now_last = drifted_pose(walk, i) * drifted_pose(walk, i - 1).inverse();
      Vec6 variances;
      variances << Vec3::Constant(walk.coasted_std_m * walk.coasted_std_m / 3),
          Vec3::Constant(1e-6);
      map.set_motion(KeyframeId(i), {KeyframeId(i - 1), T_now_last, variances.asDiagonal()});
    }
    return map;
  }

 private:
  void add(Map& map, int i, const SE3& T_seen_world, const SE3& T_camera_world, bool has_parent,
           bool follows) {
    SeenFrame seen = world_.see(T_seen_world, static_cast<std::uint32_t>(i));
    seen.T_camera_world = T_camera_world;
    std::vector<LandmarkId> followed(world_.points().size(), kNoLandmark);
    const KeyframeId parent = has_parent ? KeyframeId(i - 1) : kNoKeyframe;
    if (follows) {
      const auto& landmarks = map.keyframe(parent).landmarks;
      for (std::uint32_t k = 0; k < landmarks.size(); ++k)
        followed[static_cast<std::size_t>(points_of_parent_[k])] = landmarks[k];
    }
    const KeyframeId id = map_test::add_keyframe(map, seen, parent);
    for (std::uint32_t k = 0; k < seen.point.size(); ++k) {
      const LandmarkId landmark = followed[static_cast<std::size_t>(seen.point[k])];
      if (landmark != kNoLandmark) {
        map.add_observation(landmark, id, k);
        map.refresh(landmark);
        continue;
      }
      const Feature& f = seen.features->points[k];
      const Vec3 p_camera = camera().unproject(f.ideal_px.cast<double>(), f.depth_m);
      map.add_landmark(seen.T_camera_world.inverse() * p_camera, id, k);
    }
    points_of_parent_ = std::move(seen.point);
  }

  World world_;
  std::vector<int> points_of_parent_;  // per feature of the latest keyframe
};

}  // namespace ygslam::loop_test
