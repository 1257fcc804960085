#include "mapping/culling.hpp"

#include <algorithm>

namespace ygslam {
namespace {

bool is_redundant(const Map& map, const Keyframe& keyframe, const CullingConfig& config) {
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
  return judged > 0 && redundant > config.redundant_share * judged;
}

}  // namespace

int cull_landmarks(Map& map, std::vector<LandmarkId>& recent_landmarks,
                   const CullingConfig& config) {
  const auto newest = static_cast<int>(index(map.next_keyframe_id())) - 1;
  int removed = 0;
  std::erase_if(recent_landmarks, [&](LandmarkId id) {
    if (!map.has_landmark(id)) return true;
    const Landmark& landmark = map.landmark(id);
    const int age = newest - static_cast<int>(index(landmark.first_keyframe));
    const bool old = age >= config.recent_keyframes;
    const bool thin = static_cast<int>(landmark.observations.size()) < config.min_observations;
    if (landmark.found_ratio() < config.min_found_ratio || (old && thin)) {
      map.remove_landmark(id);
      ++removed;
      return true;
    }
    return old;
  });
  return removed;
}

std::vector<KeyframeId> cull_keyframes(Map& map, KeyframeId around, const CullingConfig& config) {
  std::vector<KeyframeId> removed;
  const auto newest = static_cast<int>(index(map.next_keyframe_id())) - 1;
  for (const KeyframeId id : map.covisible(around, 1, 30)) {
    const Keyframe& keyframe = map.keyframe(id);
    if (keyframe.parent == kNoKeyframe) continue;
    if (newest - static_cast<int>(index(id)) < config.protected_keyframes) continue;
    if (!is_redundant(map, keyframe, config)) continue;
    map.remove_keyframe(id);
    removed.push_back(id);
  }
  return removed;
}

}  // namespace ygslam
