#include "objects/association.hpp"

#include <algorithm>
#include <cmath>

#include "core/assignment.hpp"

namespace ygslam {
namespace {

constexpr double kMinAffinity = 0.05;   // of overlap and common points, 0 to 1
constexpr double kFar_m = 0.6;          // depths that differ so much are not alike at all
constexpr double kMinScore = 1.5;       // sum of affinity, similarity of appearance and of depth
constexpr double kGate_m = 0.4;         // an instance farther from where a track should be ...
constexpr double kGateMps = 1.2;        // ... growing with the time it was out of sight ...
constexpr double kMaxGate_m = 4;        // ... shows another one
constexpr double kAway_s = 1;           // who came back is not taken for new after so long
constexpr double kMinSimilarity = 0.7;  // of the appearance, to know an object again
constexpr double kLost_s = 0.5;         // out of sight for so long ...
constexpr float kBodyScore = 0.5F;      // ... it is not continued by what shows little of a body
constexpr int kUnsureFrames = 10;       // who comes into sight bit by bit cannot be compared yet

/// How far an instance is from where a track should be, as a share of how far it may be. Between
/// their boxes, as centres jump where something hides a part.
double gated_distance(const Vec3& min_odom, const Vec3& max_odom, const TrackPlace& place,
                      const Track& track, double away_s) {
  const Vec3 gap = (min_odom - place.centre_odom - track.high_m)
                       .cwiseMax(place.centre_odom + track.low_m - max_odom)
                       .cwiseMax(0.0);
  return gap.norm() / std::min(kMaxGate_m, kGate_m + std::max(0.0, away_s) * kGateMps);
}

double gated_distance(const InstanceView& seen, const TrackPlace& place, const Track& track,
                      double away_s) {
  if (!seen.has_depth) return 0;
  return gated_distance(seen.min_odom, seen.max_odom, place, track, away_s);
}

/// Overlap in the image and common points, likeness of appearance and of depth. @return 0 = no
/// match.
double affinity_score(const InstanceView& seen, const PointIndices& points_on,
                      const ObjectFrame& frame, int key, const Track& track) {
  if (track.class_id != seen.class_id && track.is_known()) return 0;
  const TrackPlace& place = frame.place.at(key);
  if (gated_distance(seen, place, track, frame.seconds_since(track.seen)) > 1) return 0;
  // As who comes in or out of a corner grows or shrinks, the smaller box counts too.
  const double both = (seen.box & place.box).area();
  const double inside = both > 0 ? both / std::min(seen.box.area(), place.box.area()) : 0;
  double affinity = (iou(seen.box, place.box) + inside) / 2;
  if (points_on.size() >= kMinTrackPoints) {
    const auto common = std::count_if(points_on.begin(), points_on.end(),
                                      [&](std::uint32_t i) { return frame.track_of[i] == key; });
    affinity = (affinity + static_cast<double>(common) / static_cast<double>(points_on.size())) / 2;
  }
  const double apart_m = std::abs(seen.depth_m - frame.depth_m(place.centre_odom));
  const double nearness = seen.has_depth ? std::max(0.0, 1 - apart_m / kFar_m) : 0.5;
  const double score = affinity + track.appearance.similarity(seen.appearance) + nearness;
  return affinity < kMinAffinity || score < kMinScore ? 0 : score;
}

/// Of a track out of sight, by place and appearance. @param current the track the instance seems
/// to show, null = none. @return 0 = no match.
double reidentification_score(const InstanceView& seen, const Track* current,
                              const ObjectFrame& frame, int key, const Track& track) {
  if (current && !current->is_young()) return 0;
  const double away_s = frame.seconds_since(track.seen);
  if (track.class_id != seen.class_id || track.is_young() || (current && away_s < kAway_s))
    return 0;
  if (away_s > kLost_s && seen.score < kBodyScore) return 0;
  const auto at = frame.place.find(key);
  const double distance =
      gated_distance(seen, at != frame.place.end() ? at->second : track.place, track, away_s);
  const double similarity = track.appearance.similarity(seen.appearance);
  return distance > 1 || similarity < kMinSimilarity ? 0 : 1 - distance + similarity;
}

/// Gives instances the tracks of the greatest sum of scores, where they are above 0.
template <typename Score>
void assign_best(const std::vector<int>& keys, const Score& score, std::vector<int>& track_of) {
  Eigen::MatrixXd cost(std::ssize(track_of), std::ssize(keys));
  for (Eigen::Index s = 0; s < cost.rows(); ++s)
    for (Eigen::Index t = 0; t < cost.cols(); ++t) cost(s, t) = -score(s, keys[t]);
  const std::vector<int> column_of = assign(cost);
  for (Eigen::Index s = 0; s < cost.rows(); ++s)
    if (column_of[s] >= 0 && cost(s, column_of[s]) < 0) track_of[s] = keys[column_of[s]];
}

}  // namespace

Association associate(std::span<const InstanceView> instances,
                      std::span<const PointIndices> points_on, const ObjectFrame& frame,
                      const Tracks& tracks) {
  Association result{std::vector<int>(instances.size(), -1), {}};
  std::vector<int> in_sight, others;
  for (const auto& [key, place] : frame.place) in_sight.push_back(key);
  assign_best(
      in_sight,
      [&](Eigen::Index s, int key) {
        return affinity_score(instances[s], points_on[s], frame, key, tracks.at(key));
      },
      result.track_of);
  const std::vector<int> near = result.track_of;
  for (const auto& [key, track] : tracks)
    if (track.is_known() && std::find(near.begin(), near.end(), key) == near.end())
      others.push_back(key);
  assign_best(
      others,
      [&](Eigen::Index s, int key) {
        const Track* current = near[s] >= 0 ? &tracks.at(near[s]) : nullptr;
        return reidentification_score(instances[s], current, frame, key, tracks.at(key));
      },
      result.track_of);
  for (std::size_t s = 0; s < near.size(); ++s)
    if (near[s] >= 0 && near[s] != result.track_of[s]) result.duplicates.push_back(near[s]);
  return result;
}

bool may_be_known(const Track& young, const Tracks& tracks, Timestamp now) {
  if (young.age_frames >= kUnsureFrames) return false;
  return std::any_of(tracks.begin(), tracks.end(), [&](const auto& entry) {
    const Track& other = entry.second;
    const double away_s = seconds_between(now, other.seen);
    return other.id != kNoObject && other.is_known() && other.class_id == young.class_id &&
           away_s >= kAway_s &&
           gated_distance(young.place.centre_odom + young.low_m,
                          young.place.centre_odom + young.high_m, other.place, other, away_s) <= 1;
  });
}

}  // namespace ygslam
