#include "mapping/neighbour_fusion.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "map/search_points.hpp"

namespace ygslam {
namespace {

constexpr double kMaxNeighbourDistance_m = 2.5;
constexpr double kMinDirectionCosine = 0.5;
constexpr int kJustBefore = 8;           // keyframes
constexpr int kSharedByNeighbours = 10;  // landmarks

bool depth_agrees(const Keyframe& keyframe, std::uint32_t feature, const Vec3& p_world,
                  double max_relative) {
  const double measured_m = keyframe.data->features->points[feature].depth_m;
  if (measured_m <= 0) return true;
  const double predicted_m = (keyframe.T_camera_world * p_world).z();
  return std::abs(measured_m - predicted_m) <= max_relative * predicted_m;
}

int fuse_into(Map& map, const Camera& camera, KeyframeId target,
              const std::vector<LandmarkId>& landmarks, const NeighbourFusionConfig& config) {
  const Keyframe& keyframe = map.keyframe(target);
  std::vector<std::uint8_t> usable(keyframe.landmarks.size());
  for (std::size_t i = 0; i < usable.size(); ++i) usable[i] = keyframe.static_weight[i] > 0;
  ProjectionMatcherConfig matcher;
  matcher.max_distance = config.max_distance;
  matcher.ratio = 1.0;
  const auto matches =
      match_by_projection(camera, keyframe.T_camera_world,
                          visible_points(map, keyframe.T_camera_world, landmarks, config.search_px),
                          *keyframe.data->features, keyframe.data->grid, usable, matcher);
  int changes = 0;
  for (const PointMatch& m : matches) {
    const LandmarkId id = map.current_id(landmarks[m.source]);
    if (id == kNoLandmark) continue;
    if (!depth_agrees(keyframe, m.feature, map.landmark(id).p_world, config.max_depth_error))
      continue;
    const LandmarkId there = keyframe.landmarks[m.feature];
    if (there == id) continue;
    if (there == kNoLandmark) {
      if (map.add_observation(id, target, m.feature)) {
        map.refresh(id);
        ++changes;
      }
      continue;
    }
    const bool keep_there =
        map.landmark(there).observations.size() > map.landmark(id).observations.size();
    map.fuse(keep_there ? id : there, keep_there ? there : id);
    ++changes;
  }
  return changes;
}

/// Keyframes made just before, those that share landmarks, and those that these share some with.
/// What is near in space alone may be there by drift: to join it is for loops.
std::set<KeyframeId> near_in_map(const Map& map, const Keyframe& keyframe) {
  std::set<KeyframeId> near;
  const auto add_with_covisible = [&](KeyframeId id) {
    near.insert(id);
    for (const auto& [other, shared] : map.keyframe(id).covisible) near.insert(other);
  };
  for (const auto& [id, shared] : keyframe.covisible) add_with_covisible(id);
  KeyframeId before = keyframe.parent;
  for (int i = 0; i < kJustBefore && map.has_keyframe(before); ++i) {
    add_with_covisible(before);
    before = map.keyframe(before).parent;
  }
  return near;
}

std::vector<LandmarkId> landmarks_of(const Map& map, const std::vector<KeyframeId>& keyframes,
                                     const Keyframe& except) {
  std::set<LandmarkId> have(except.landmarks.begin(), except.landmarks.end());
  std::vector<LandmarkId> landmarks;
  for (const KeyframeId id : keyframes) {
    for (const LandmarkId landmark : map.keyframe(id).landmarks) {
      if (landmark != kNoLandmark && have.insert(landmark).second) landmarks.push_back(landmark);
    }
  }
  return landmarks;
}

}  // namespace

std::vector<KeyframeId> neighbours(const Map& map, KeyframeId id, std::size_t max_count) {
  std::vector<KeyframeId> result = map.covisible(id, kSharedByNeighbours, max_count);
  const Keyframe& keyframe = map.keyframe(id);
  const Vec3 position = keyframe.position_world();
  const Vec3 direction = keyframe.T_camera_world.R().row(2);
  std::vector<std::pair<double, KeyframeId>> near;
  for (const KeyframeId other_id : near_in_map(map, keyframe)) {
    if (other_id == id || std::find(result.begin(), result.end(), other_id) != result.end())
      continue;
    const Keyframe& other = map.keyframe(other_id);
    const double distance_m = (other.position_world() - position).norm();
    const double cosine = direction.dot(Vec3(other.T_camera_world.R().row(2)));
    if (distance_m > kMaxNeighbourDistance_m || cosine < kMinDirectionCosine) continue;
    near.emplace_back(distance_m + 2.0 * (1.0 - cosine), other_id);
  }
  std::sort(near.begin(), near.end());
  for (const auto& [score, other] : near) {
    if (result.size() >= max_count) break;
    result.push_back(other);
  }
  return result;
}

int fuse_with_neighbours(Map& map, const Camera& camera, KeyframeId id,
                         const NeighbourFusionConfig& config) {
  return fuse_with(map, camera, id,
                   neighbours(map, id, static_cast<std::size_t>(config.max_neighbours)), config);
}

int fuse_with(Map& map, const Camera& camera, KeyframeId id, const std::vector<KeyframeId>& around,
              const NeighbourFusionConfig& config) {
  int changes = fuse_into(map, camera, id, landmarks_of(map, around, map.keyframe(id)), config);
  for (const KeyframeId neighbour : around) {
    std::vector<LandmarkId> own;
    const auto& theirs = map.keyframe(neighbour);
    const std::set<LandmarkId> have(theirs.landmarks.begin(), theirs.landmarks.end());
    for (const LandmarkId landmark : map.keyframe(id).landmarks) {
      if (landmark != kNoLandmark && !have.contains(landmark)) own.push_back(landmark);
    }
    changes += fuse_into(map, camera, neighbour, own, config);
  }
  return changes;
}

}  // namespace ygslam
