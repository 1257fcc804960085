#include "loop/submap_joiner.hpp"

#include <algorithm>

namespace ygslam {
namespace {

constexpr std::size_t kMostCommonViews = 500;  // the oldest go
constexpr std::size_t kMinWithinReach = 2;

using Roots = std::map<KeyframeId, KeyframeId>;

/// A keyframe of a submap that is older than the root of another: the newest.
KeyframeId parent_in(const Roots& roots, KeyframeId submap, KeyframeId root) {
  KeyframeId parent = submap;
  for (const auto& [id, its_root] : roots)
    if (its_root == submap && id < root) parent = id;
  return parent;
}

MapPatch moved(const Map& map, const Roots& roots, KeyframeId submap, const SE3& T_older_younger) {
  MapPatch patch = map.start_patch();
  for (const auto& [id, root] : roots) {
    if (root != submap) continue;
    const SE3& T_camera_world = map.keyframe(id).T_camera_world;
    patch.poses.push_back(
        {id, T_camera_world, (T_camera_world * T_older_younger.inverse()).normalized()});
  }
  return patch;
}

}  // namespace

std::optional<SubmapJoin> SubmapJoiner::step(const Map& map,
                                             std::span<const LoopAttempt> attempts) {
  bool is_new = false;
  for (const LoopAttempt& attempt : attempts) {
    if (attempt.outcome != LoopOutcome::kOtherSubmap) continue;
    remember(map, attempt.keyframe, SE3(), attempt.match);
    is_new = true;
  }
  return is_new ? try_latest(map) : std::nullopt;
}

std::optional<SubmapJoin> SubmapJoiner::step(const Map& map, KeyframeId reference,
                                             const SE3& T_camera_reference,
                                             const PlaceMatch& match) {
  if (map.root_of(reference) == map.root_of(match.place)) return std::nullopt;
  remember(map, reference, T_camera_reference, match);
  return try_latest(map);
}

void SubmapJoiner::remember(const Map& map, KeyframeId reference, const SE3& T_camera_reference,
                            const PlaceMatch& match) {
  forget_what_is_gone(map);
  const SE3 T_camera_place =
      match.T_camera_world * map.keyframe(match.place).T_camera_world.inverse();
  if (map.root_of(match.place) < map.root_of(reference)) {
    common_views_.push_back(
        {reference, match.place, T_camera_reference, T_camera_place, match.inliers});
  } else {
    common_views_.push_back(
        {match.place, reference, T_camera_place, T_camera_reference, match.inliers});
  }
  if (common_views_.size() > kMostCommonViews) common_views_.pop_front();
}

void SubmapJoiner::forget_what_is_gone(const Map& map) {
  std::erase_if(common_views_, [&](const CommonView& view) {
    return !map.has_keyframe(view.in_younger) || !map.has_keyframe(view.in_older) ||
           map.root_of(view.in_younger) == map.root_of(view.in_older);
  });
}

std::vector<MapPair> SubmapJoiner::pairs_of_latest(const Map& map) const {
  const KeyframeId younger = map.root_of(common_views_.back().in_younger);
  const KeyframeId older = map.root_of(common_views_.back().in_older);
  std::vector<MapPair> pairs;
  for (const CommonView& view : common_views_) {
    if (map.root_of(view.in_younger) != younger || map.root_of(view.in_older) != older) continue;
    PlaceMatch match;
    match.place = view.in_older;
    match.verdict = PlaceVerdict::kAgrees;
    match.inliers = view.inliers;
    match.T_camera_world = view.T_camera_older * map.keyframe(view.in_older).T_camera_world;
    pairs.push_back({view.in_younger,
                     view.T_camera_younger * map.keyframe(view.in_younger).T_camera_world, match});
  }
  return pairs;
}

bool SubmapJoiner::is_within_reach(const Map& map, KeyframeId root,
                                   const MapAlignment& alignment) const {
  const auto reach = reach_m_.find(root);
  if (reach == reach_m_.end() || alignment.pairs.size() < kMinWithinReach) return false;
  const Vec3 begin_b = map.keyframe(root).position_world();
  return (alignment.T_a_b * begin_b - begin_b).norm() <= reach->second;
}

std::optional<SubmapJoin> SubmapJoiner::try_latest(const Map& map) const {
  const KeyframeId younger = map.root_of(common_views_.back().in_younger);
  const KeyframeId older = map.root_of(common_views_.back().in_older);
  MapAlignment alignment = align_pairs(pairs_of_latest(map), config_);
  const bool joins = alignment.outcome == MapAlignment::Outcome::kAligned ||
                     (alignment.outcome == MapAlignment::Outcome::kNoOverlap &&
                      older == map.origin() && is_within_reach(map, younger, alignment));
  if (!joins) return std::nullopt;
  const Roots roots = map.roots();
  return SubmapJoin{younger, parent_in(roots, older, younger),
                    moved(map, roots, younger, alignment.T_a_b), std::move(alignment.pairs)};
}

}  // namespace ygslam
