#include "mapping/neighbour_fusion.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "map/projection_matcher.hpp"

namespace ygslam {
namespace {

constexpr double kMaxNeighbourDistanceM = 2.5;
constexpr double kMinDirectionCosine = 0.5;

// Search points for those landmarks that the keyframe could see and does not yet.
std::vector<SearchPoint> visible_points(const Map& map, const Keyframe& keyframe,
                                        const std::vector<LandmarkId>& landmarks,
                                        const NeighbourFusionConfig& config) {
  const Vec3 centre_world = keyframe.position_world();
  std::vector<SearchPoint> points;
  for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
    const Landmark& landmark = map.landmark(landmarks[i]);
    const Vec3 ray = landmark.p_world - centre_world;
    const double range_m = ray.norm();
    if (range_m < 0.8 * landmark.min_distance_m || range_m > 1.2 * landmark.max_distance_m)
      continue;
    if (ray.dot(landmark.normal_world) < 0.5 * range_m) continue;
    const int octave = map.scales().octave_at(landmark.max_distance_m / range_m);
    points.push_back({landmark.p_world, &landmark.descriptor, std::max(0, octave - 1),
                      std::min(map.scales().levels() - 1, octave + 1),
                      config.search_px * map.scales().of(octave), -1.0F, i});
  }
  return points;
}

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
  const auto matches = match_by_projection(
      camera, keyframe.T_camera_world, visible_points(map, keyframe, landmarks, config),
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
  std::vector<KeyframeId> result = map.covisible(id, 10, max_count);
  const Keyframe& keyframe = map.keyframe(id);
  const Vec3 position = keyframe.position_world();
  const Vec3 direction = keyframe.T_camera_world.R().row(2);
  std::vector<std::pair<double, KeyframeId>> near;
  for (const auto& [other_id, other] : map.keyframes()) {
    if (other_id == id || std::find(result.begin(), result.end(), other_id) != result.end())
      continue;
    const double distance_m = (other.position_world() - position).norm();
    const double cosine = direction.dot(Vec3(other.T_camera_world.R().row(2)));
    if (distance_m > kMaxNeighbourDistanceM || cosine < kMinDirectionCosine) continue;
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
  const auto around = neighbours(map, id, static_cast<std::size_t>(config.max_neighbours));
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
