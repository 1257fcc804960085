// The part of the map that a local bundle adjustment works on, out of the map and back into it.
#pragma once

#include <vector>

#include "geometry/camera.hpp"
#include "map/map.hpp"
#include "map/map_gravity.hpp"
#include "map/observation_noise.hpp"
#include "optim/local_bundle.hpp"

namespace ygslam {

struct BundleWindowConfig {
  int free_keyframes = 12;   ///< the newest and its most covisible
  int fixed_keyframes = 20;  ///< others that see the same landmarks, most observations first
};

/// The problem is set up in the frame of the newest keyframe: far from the origin numbers lose
/// digits, and damping along axes must not depend on how the world is turned.
struct BundleWindow {
  SE3 T_local_world;
  BundleProblem problem;              ///< its "world" is the local frame
  std::vector<KeyframeId> keyframes;  ///< of problem.poses
  std::vector<LandmarkId> landmarks;  ///< of problem.points_world
};

/// @param gravity what is known of it from earlier windows.
[[nodiscard]] BundleWindow make_bundle_window(const Map& map, KeyframeId newest,
                                              const NoiseConfig& noise,
                                              const BundleWindowConfig& config,
                                              GravityOfGrowingMap& gravity);
/// The only one.
[[nodiscard]] inline BundleWindow make_bundle_window(const Map& map, KeyframeId newest,
                                                     const NoiseConfig& noise,
                                                     const BundleWindowConfig& config) {
  GravityOfGrowingMap gravity;
  return make_bundle_window(map, newest, noise, config, gravity);
}

/// Everything: keyframes without a parent hold the gauge, landmarks seen once say nothing.
/// @param map not empty.
[[nodiscard]] BundleWindow make_whole_window(const Map& map, const NoiseConfig& noise);

/// Writes poses and points back and removes the observations that disagree.
void apply_bundle(Map& map, const BundleWindow& window, const BundleResult& result);

}  // namespace ygslam
