#include "system/map_merge.hpp"

#include <algorithm>

#include "mapping/full_adjustment.hpp"
#include "mapping/neighbour_fusion.hpp"

namespace ygslam {
namespace {

constexpr double kDrift_px = 10;  // of b in itself: what it shows may lie so far from a's
constexpr std::size_t kFusedKeyframes = 10;

/// Numbers of b in the merged map.
using Numbers = std::map<KeyframeId, KeyframeId>;

Numbers add_keyframes(Map& map, const Map& b, const MapAlignment& alignment) {
  const SE3 T_b_a = alignment.T_a_b.inverse();
  const KeyframeId joint = alignment.pairs.front().match.place;
  Numbers numbers;
  for (const auto& [id, keyframe] : b.keyframes()) {
    auto data = std::make_shared<KeyframeData>(*keyframe.data);
    data->id = numbers[id] = map.next_keyframe_id();
    data->frame = kNoFrame;
    // What b never joined to its own world stays a submap by itself.
    KeyframeId parent = id == b.main_root() ? joint : kNoKeyframe;
    if (const auto known = numbers.find(keyframe.parent); known != numbers.end())
      parent = known->second;
    map.add_keyframe(std::move(data), (keyframe.T_camera_world * T_b_a).normalized(), parent,
                     keyframe.static_weight);
  }
  return numbers;
}

void add_landmarks(Map& map, const Map& b, const MapAlignment& alignment, const Numbers& numbers) {
  std::vector<LandmarkId> ids;  // the same maps give the same map
  b.for_each_landmark([&](const Landmark& landmark) { ids.push_back(landmark.id); });
  std::sort(ids.begin(), ids.end());
  for (const LandmarkId id : ids) {
    const Landmark& landmark = b.landmark(id);
    const LandmarkObservation& first = landmark.observations.front();
    const LandmarkId added = map.add_landmark(alignment.T_a_b * landmark.p_world,
                                              numbers.at(first.keyframe), first.feature);
    for (std::size_t i = 1; i < landmark.observations.size(); ++i) {
      const LandmarkObservation& o = landmark.observations[i];
      map.add_observation(added, numbers.at(o.keyframe), o.feature);
    }
    map.count_seen(added, landmark.visible - 1, landmark.found - 1);
    map.refresh(added);
  }
}

void fuse_pairs(Map& map, const Camera& camera, const MapAlignment& alignment,
                const Numbers& numbers, const NeighbourFusionConfig& config) {
  for (const MapPair& pair : alignment.pairs) {
    std::vector<KeyframeId> place = map.with_covisible(pair.match.place, 1, kFusedKeyframes);
    const KeyframeId in_b = numbers.at(pair.in_b);
    std::erase(place, in_b);
    fuse_with(map, camera, in_b, place, config);
  }
}

void adjust(Map& map, const Camera& camera, const MapperConfig& config) {
  if (const auto patch = solve(camera, make_full_adjustment(map, config.noise), config.bundle))
    map.apply(*patch);
}

}  // namespace

Map merge_maps(const Map& a, const Map& b, const MapAlignment& alignment, const Camera& camera,
               const MapperConfig& config) {
  Map map = a;
  const Numbers numbers = add_keyframes(map, b, alignment);
  add_landmarks(map, b, alignment, numbers);
  NeighbourFusionConfig wide = config.fusion;
  wide.search_px = kDrift_px;
  fuse_pairs(map, camera, alignment, numbers, wide);
  adjust(map, camera, config);
  fuse_pairs(map, camera, alignment, numbers, config.fusion);
  adjust(map, camera, config);
  return map;
}

}  // namespace ygslam
