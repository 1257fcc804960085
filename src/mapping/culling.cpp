#include "mapping/culling.hpp"

#include <algorithm>
#include <set>
#include <span>

#include "map/known_ground.hpp"
#include "mapping/neighbour_fusion.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kSpaceNeighbours = 12;
constexpr std::size_t kJudgedKeyframes = 30;
constexpr double kNearest_m = 0.3;
constexpr double kThrough_m = 0.1;  // farther than the noise of depth and pose ...
constexpr double kThroughRatio = 0.1;

bool is_redundant(const Map& map, const Keyframe& keyframe, double share,
                  const CullingConfig& config) {
  int judged = 0;
  int redundant = 0;
  for (std::uint32_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (keyframe.landmarks[i] == kNoLandmark) continue;
    ++judged;
    const Landmark& landmark = map.landmark(keyframe.landmarks[i]);
    const int octave = keyframe.data->features->points[i].octave;
    int observers = 0;
    for (const LandmarkObservation& o : landmark.observations) {
      if (o.keyframe == keyframe.data->id) continue;
      const int other = map.keyframe(o.keyframe).data->features->points[o.feature].octave;
      observers += static_cast<int>(other <= octave + 1);
      if (observers >= config.redundant_observers) break;
    }
    redundant += static_cast<int>(observers >= config.redundant_observers);
  }
  return judged > 0 && redundant > share * judged;
}

/// Whether a keyframe of an earlier visit shows the same.
bool is_revisit(const Map& map, const Keyframe& keyframe, std::span<const KeyframeId> near) {
  return std::any_of(near.begin(), near.end(), [&](KeyframeId id) {
    if (!map.has_keyframe(id)) return false;
    const Keyframe& other = map.keyframe(id);
    const SE3 T_this_other = keyframe.T_camera_world * other.T_camera_world.inverse();
    return seconds_between(keyframe.data->stamp, other.data->stamp) > KnownGround::kVisit_s &&
           T_this_other.t().norm() < KnownGround::kNear_m &&
           T_this_other.angle() < KnownGround::kNear_rad;
  });
}

/// Whether the keyframe saw nothing but what lies clearly behind the point.
bool sees_through(const Camera& camera, const Keyframe& keyframe, const Vec3& p_world) {
  const Vec3 p_camera = keyframe.T_camera_world * p_world;
  if (p_camera.z() < kNearest_m) return false;
  const double nearest_m =
      keyframe.data->free_space.around_m(camera.distort(camera.project(p_camera)));
  return p_camera.z() < nearest_m - std::max(kThrough_m, kThroughRatio * nearest_m);
}

}  // namespace

void cull_landmarks(Map& map, std::vector<LandmarkId>& recent_landmarks,
                    const CullingConfig& config) {
  const auto newest = static_cast<int>(index(map.next_keyframe_id())) - 1;
  std::erase_if(recent_landmarks, [&](LandmarkId id) {
    if (!map.has_landmark(id)) return true;
    const Landmark& landmark = map.landmark(id);
    const int age = newest - static_cast<int>(index(landmark.first_keyframe));
    const bool old = age >= config.recent_keyframes;
    const bool thin = static_cast<int>(landmark.observations.size()) < config.min_observations;
    if (landmark.found_ratio() < config.min_found_ratio || (old && thin)) {
      map.remove_landmark(id);
      return true;
    }
    return old;
  });
}

int cull_seen_through(Map& map, const Camera& camera, KeyframeId id, const CullingConfig& config) {
  const Keyframe& keyframe = map.keyframe(id);
  const std::set<LandmarkId> seen(keyframe.landmarks.begin(), keyframe.landmarks.end());
  int removed = 0;
  for (const LandmarkId landmark_id : map.landmarks_of(neighbours(map, id, kSpaceNeighbours))) {
    const Landmark& landmark = map.landmark(landmark_id);
    if (seen.contains(landmark_id)) {
      map.set_seen_through(landmark_id, 0);
    } else if (sees_through(camera, keyframe, landmark.p_world)) {
      map.set_seen_through(landmark_id, landmark.seen_through + 1);
    }
    if (landmark.seen_through < config.seen_through) continue;
    map.remove_landmark(landmark_id);
    ++removed;
  }
  return removed;
}

std::vector<KeyframeId> cull_keyframes(Map& map, KeyframeId around, const CullingConfig& config) {
  std::vector<KeyframeId> removed;
  const auto newest = static_cast<int>(index(map.next_keyframe_id())) - 1;
  const std::vector<KeyframeId> judged = map.covisible(around, 1, kJudgedKeyframes);
  for (const KeyframeId id : judged) {
    const Keyframe& keyframe = map.keyframe(id);
    if (keyframe.parent == kNoKeyframe) continue;
    if (newest - static_cast<int>(index(id)) < config.protected_keyframes) continue;
    const double share =
        is_revisit(map, keyframe, judged) ? config.revisit_share : config.redundant_share;
    if (!is_redundant(map, keyframe, share, config)) continue;
    map.remove_keyframe(id);
    removed.push_back(id);
  }
  return removed;
}

}  // namespace ygslam
