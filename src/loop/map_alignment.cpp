#include "loop/map_alignment.hpp"

#include <algorithm>
#include <numbers>

namespace ygslam {
namespace {

constexpr double kIndependent_m = 1;
constexpr double kIndependent_rad = std::numbers::pi / 6;

SE3 alignment_of(const MapPair& pair) {
  return pair.match.T_camera_world.inverse() * pair.T_camera_b;
}

Vec3 position_b(const MapPair& pair) { return pair.T_camera_b.inverse().t(); }

/// The pairs that agree with the alignment which one of them claims.
std::vector<MapPair> supporters(const std::vector<MapPair>& pairs, const MapPair& of,
                                const MapAlignmentConfig& config) {
  const SE3 T_a_b = alignment_of(of);
  const Vec3 from_b = position_b(of);
  std::vector<MapPair> agree;
  for (const MapPair& pair : pairs) {
    const Vec3 at_b = position_b(pair);
    const SE3 T_other = alignment_of(pair);
    const double off_m = (T_a_b * at_b - T_other * at_b).norm();
    const double off_rad = (T_a_b.inverse() * T_other).angle();
    const double way_m = (at_b - from_b).norm();
    if (off_m <= config.same_m + config.same_ratio * way_m && off_rad <= config.same_rad)
      agree.push_back(pair);
  }
  return agree;
}

int count_independent(const std::vector<MapPair>& pairs) {
  std::vector<SE3> chosen;
  for (const MapPair& pair : pairs) {
    const SE3 T_world_camera = pair.T_camera_b.inverse();
    const bool independent = std::all_of(chosen.begin(), chosen.end(), [&](const SE3& other) {
      const SE3 between = other.inverse() * T_world_camera;
      return between.t().norm() > kIndependent_m || between.angle() > kIndependent_rad;
    });
    if (independent) chosen.push_back(T_world_camera);
  }
  return static_cast<int>(chosen.size());
}

double extent_m(const std::vector<MapPair>& pairs) {
  double largest = 0;
  for (const MapPair& i : pairs)
    for (const MapPair& j : pairs)
      largest = std::max(largest, (position_b(i) - position_b(j)).norm());
  return largest;
}

/// The largest set that agrees with one of the pairs.
std::vector<MapPair> best_supported(const std::vector<MapPair>& pairs,
                                    const MapAlignmentConfig& config) {
  std::vector<MapPair> best;
  for (const MapPair& pair : pairs) {
    auto agree = supporters(pairs, pair, config);
    if (agree.size() > best.size()) best = std::move(agree);
  }
  return best;
}

}  // namespace

MapAlignment align_maps(const Map& a, const Map& b, const Camera& camera,
                        const MapAlignmentConfig& config) {
  PlaceIndex index(config.index);
  index.rebuild(a);
  const PlaceFinder finder(config.finder, camera);
  std::vector<MapPair> pairs;
  for (const auto& [id, keyframe] : b.keyframes()) {
    for (const FoundPlace& place : finder.find(a, index, view_of(keyframe), {}, ygslam::index(id)))
      if (place.match.verdict == PlaceVerdict::kAgrees)
        pairs.push_back({id, keyframe.T_camera_world, place.match});
  }
  return align_pairs(pairs, config);
}

MapAlignment align_pairs(const std::vector<MapPair>& pairs, const MapAlignmentConfig& config) {
  MapAlignment result;
  result.found = static_cast<int>(pairs.size());
  result.pairs = best_supported(pairs, config);
  result.independent = count_independent(result.pairs);
  if (result.pairs.empty()) return result;
  const auto most = std::max_element(
      result.pairs.begin(), result.pairs.end(),
      [](const MapPair& x, const MapPair& y) { return x.match.inliers < y.match.inliers; });
  result.T_a_b = alignment_of(*most);
  if (result.independent < config.min_pairs) return result;
  std::vector<MapPair> others;
  for (const MapPair& pair : pairs) {
    const bool agrees = std::any_of(
        result.pairs.begin(), result.pairs.end(),
        [&](const MapPair& p) { return p.in_b == pair.in_b && p.match.place == pair.match.place; });
    if (!agrees) others.push_back(pair);
  }
  const auto rival = best_supported(others, config);
  result.extent_m = extent_m(result.pairs);
  const bool ambiguous = static_cast<double>(rival.size()) >=
                             config.ambiguous_share * static_cast<double>(result.pairs.size()) &&
                         count_independent(rival) >= config.min_pairs;
  result.outcome = ambiguous ? MapAlignment::Outcome::kAmbiguous : MapAlignment::Outcome::kAligned;
  return result;
}

}  // namespace ygslam
