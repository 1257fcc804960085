// A map of points seen from six keyframes, the last of them the last frame, and a frame after it.
#pragma once

#include <utility>
#include <vector>

#include "map/map_test_world.hpp"
#include "tracking/pose_estimator.hpp"

namespace ygslam::tracking_test {

using map_test::World;

inline FrameFeatures features_of(const map_test::SeenFrame& seen) {
  return {
      seen.frame, seen.features, seen.grid, {}, std::vector<float>(seen.features->size(), 1.0F)};
}

inline LocalView view_of(const Map& map) {
  LocalView view;
  for (auto it = map.keyframes().rbegin(); it != map.keyframes().rend(); ++it) {
    ViewKeyframe keyframe{it->second.data, it->second.T_camera_world, {}, 0};
    for (const LandmarkId id : it->second.landmarks) {
      if (id == kNoLandmark) {
        keyframe.landmarks.push_back(-1);
        continue;
      }
      const auto [entry, is_new] =
          view.landmark_index.emplace(id, static_cast<std::uint32_t>(view.landmarks.size()));
      if (is_new) {
        const Landmark& l = map.landmark(id);
        view.landmarks.push_back(
            {id, l.p_world, l.normal_world, l.descriptor, l.min_distance_m, l.max_distance_m});
      }
      keyframe.landmarks.push_back(static_cast<std::int32_t>(entry->second));
    }
    view.keyframes.push_back(std::move(keyframe));
  }
  return view;
}

inline double pose_error(const SE3& T_estimate, const SE3& T_truth) {
  return (T_estimate * T_truth.inverse()).log().norm();
}

struct PointScene {
  explicit PointScene(std::uint64_t seed, int points = 700,
                      const map_test::ViewQuality& quality = {.noise_px = 0.5})
      : PointScene(World(points, seed), quality) {}
  PointScene(World seen_world, const map_test::ViewQuality& quality)
      : world(std::move(seen_world)),
        truth(map_test::true_map(world, 6, quality)),
        view(view_of(truth.map)),
        last{features_of(truth.seen.back()),
             truth.map.keyframe(KeyframeId{5}).landmarks,
             {},
             {},
             {}},
        now(world.see(World::pose(6), 100, quality)),
        frame(features_of(now)),
        estimator({}, world.camera(), {map_test::kLevels, map_test::kScale}) {}
  [[nodiscard]] std::optional<PoseResult> track(const SE3& T_guess, Rng& rng) const {
    return track(frame, view, T_guess, rng);
  }
  [[nodiscard]] std::optional<PoseResult> track(const FrameFeatures& current, const LocalView& map,
                                                const SE3& T_guess, Rng& rng) const {
    const auto first =
        estimator.match_previous_frame(current, last, World::pose(5), map, T_guess, rng);
    return first ? estimator.match_map(current, map, *first) : std::nullopt;
  }

  World world;
  map_test::TrueMap truth;
  LocalView view;
  TrackedFrame last;
  map_test::SeenFrame now;
  FrameFeatures frame;
  PoseEstimator estimator;
};

}  // namespace ygslam::tracking_test
