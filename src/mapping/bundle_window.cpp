#include "mapping/bundle_window.hpp"

#include <algorithm>
#include <map>
#include <span>

namespace ygslam {
namespace {

constexpr float kLeastWeight = 0.05F;  // what became a landmark keeps a say

std::vector<KeyframeId> other_observers(const Map& map, const std::vector<LandmarkId>& landmarks,
                                        const std::vector<KeyframeId>& except, int max_count) {
  std::map<KeyframeId, int> counts;
  for (const LandmarkId id : landmarks) {
    for (const LandmarkObservation& o : map.landmark(id).observations) ++counts[o.keyframe];
  }
  for (const KeyframeId id : except) counts.erase(id);
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const auto& [id, count] : counts) ranked.emplace_back(-count, id);
  std::sort(ranked.begin(), ranked.end());
  if (ranked.size() > static_cast<std::size_t>(max_count)) ranked.resize(max_count);
  std::vector<KeyframeId> ids;
  for (const auto& [count, id] : ranked) ids.push_back(id);
  return ids;
}

/// A keyframe that nothing known was seen from shares no landmark with where its motion began.
/// @param free_count of the keyframes, the first.
void add_starts_of_motions(const Map& map, std::size_t free_count,
                           std::vector<KeyframeId>& keyframes) {
  std::vector<KeyframeId> starts;
  for (const KeyframeId id : std::span(keyframes).first(free_count)) {
    const auto& motion = map.keyframe(id).motion;
    if (motion && std::ranges::find(keyframes, motion->from) == keyframes.end())
      starts.push_back(motion->from);
  }
  std::ranges::sort(starts);
  const auto copies = std::ranges::unique(starts);
  keyframes.insert(keyframes.end(), starts.begin(), copies.begin());
}

/// Poses, points and observations of the window's keyframes, of which the first are free.
/// @param gravity of these.
void state_problem(const Map& map, const NoiseConfig& noise, std::size_t free_count,
                   const std::map<KeyframeId, MeasuredDirection>& gravity, BundleWindow& window) {
  const SE3 T_world_local = window.T_local_world.inverse();
  std::map<KeyframeId, std::uint32_t> pose_of;
  for (std::uint32_t i = 0; i < window.keyframes.size(); ++i) {
    const Keyframe& keyframe = map.keyframe(window.keyframes[i]);
    const bool fixed = i >= free_count || keyframe.parent == kNoKeyframe;
    window.problem.poses.push_back({keyframe.T_camera_world * T_world_local, fixed});
    pose_of[window.keyframes[i]] = i;
  }
  // Something must hold the gauge.
  const auto& poses = window.problem.poses;
  if (std::none_of(poses.begin(), poses.end(), [](const BundlePose& p) { return p.fixed; })) {
    window.problem.poses.front().fixed = true;
  }
  for (const auto& [id, to] : pose_of) {
    const auto& motion = map.keyframe(id).motion;
    const auto from = motion ? pose_of.find(motion->from) : pose_of.end();
    if (from == pose_of.end() || (poses[from->second].fixed && poses[to].fixed)) continue;
    window.problem.motions.push_back(
        {from->second, to, motion->T_keyframe_from, motion->covariance.inverse()});
  }
  for (auto [id, direction] : gravity) {
    direction.pose = pose_of.at(id);
    if (poses[direction.pose].fixed) continue;
    direction.direction_world = window.T_local_world.R() * direction.direction_world;
    window.problem.directions.push_back(direction);
  }
  for (std::uint32_t i = 0; i < window.landmarks.size(); ++i) {
    const Landmark& landmark = map.landmark(window.landmarks[i]);
    window.problem.points_world.push_back(window.T_local_world * landmark.p_world);
    for (const LandmarkObservation& o : landmark.observations) {
      const auto pose = pose_of.find(o.keyframe);
      if (pose == pose_of.end()) continue;
      const Keyframe& keyframe = map.keyframe(o.keyframe);
      const Feature& feature = keyframe.data->features->points[o.feature];
      const double weight = std::max(kLeastWeight, keyframe.static_weight[o.feature]);
      window.problem.observations.push_back(
          {pose->second, i,
           observation_of(feature, map.scales().of(feature.octave), noise, weight)});
    }
  }
}

}  // namespace

BundleWindow make_bundle_window(const Map& map, KeyframeId newest, const NoiseConfig& noise,
                                const BundleWindowConfig& config, GravityOfGrowingMap& gravity) {
  BundleWindow window;
  window.T_local_world = map.keyframe(newest).T_camera_world;
  window.keyframes =
      map.with_covisible(newest, 1, static_cast<std::size_t>(config.free_keyframes - 1));
  std::sort(window.keyframes.begin(), window.keyframes.end());
  window.landmarks = map.landmarks_of(window.keyframes);
  const std::size_t free_count = window.keyframes.size();
  for (const KeyframeId id :
       other_observers(map, window.landmarks, window.keyframes, config.fixed_keyframes)) {
    window.keyframes.push_back(id);
  }
  add_starts_of_motions(map, free_count, window.keyframes);
  const std::span<const KeyframeId> adjusted = std::span(window.keyframes).first(free_count);
  state_problem(map, noise, free_count, gravity.of(map, adjusted), window);
  return window;
}

BundleWindow make_whole_window(const Map& map, const NoiseConfig& noise) {
  BundleWindow window;
  window.T_local_world = map.keyframe(map.origin()).T_camera_world;
  for (const auto& [id, keyframe] : map.keyframes()) window.keyframes.push_back(id);
  map.for_each_landmark([&](const Landmark& landmark) {
    if (landmark.observations.size() > 1) window.landmarks.push_back(landmark.id);
  });
  std::sort(window.landmarks.begin(), window.landmarks.end());
  state_problem(map, noise, window.keyframes.size(), measured_gravity(map), window);
  return window;
}

void apply_bundle(Map& map, const BundleWindow& window, const BundleResult& result) {
  if (!result.usable) return;
  const SE3 T_world_local = window.T_local_world.inverse();
  for (std::size_t i = 0; i < window.keyframes.size(); ++i) {
    if (window.problem.poses[i].fixed) continue;
    map.set_pose(window.keyframes[i],
                 (result.T_camera_world[i] * window.T_local_world).normalized());
  }
  for (std::size_t i = 0; i < window.landmarks.size(); ++i) {
    map.set_position(window.landmarks[i], T_world_local * result.points_world[i]);
  }
  for (std::size_t i = 0; i < window.problem.observations.size(); ++i) {
    if (!result.outlier[i]) continue;
    const BundleObservation& o = window.problem.observations[i];
    if (map.has_landmark(window.landmarks[o.point])) {
      map.remove_observation(window.landmarks[o.point], window.keyframes[o.pose]);
    }
  }
  for (const LandmarkId id : window.landmarks) {
    if (map.has_landmark(id)) map.refresh(id);
  }
}

}  // namespace ygslam
