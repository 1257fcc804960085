#include "loop/place_finder.hpp"

namespace ygslam {
namespace {

constexpr double kSamePlace_m = 0.5;  // two poses nearer than this are of one place
constexpr double kSamePlace_rad = 0.17;

}  // namespace

std::vector<FoundPlace> PlaceFinder::find(const Map& map, const PlaceIndex& index,
                                          const PlaceView& view,
                                          std::span<const KeyframeId> excluded,
                                          std::uint64_t seed) const {
  std::vector<FoundPlace> found;
  const auto hits = index.query(map, view.features, view.static_weight);
  for (const PlaceCandidate& place : index.candidates(map, hits, excluded, config_.places))
    found.push_back({place.score, verifier_.verify(map, view, place.keyframe, seed)});
  return found;
}

bool PlaceFinder::rivals(const PlaceMatch& best, const PlaceMatch& other) const {
  const SE3 T_best_other = best.T_camera_world * other.T_camera_world.inverse();
  const bool elsewhere =
      T_best_other.t().norm() >= kSamePlace_m || T_best_other.angle() >= kSamePlace_rad;
  return elsewhere && other.inliers >= config_.ambiguous_share * best.inliers;
}

std::optional<PlaceMatch> PlaceFinder::find_one(const Map& map, const PlaceIndex& index,
                                                const PlaceView& view, std::uint64_t seed) const {
  const auto found = find(map, index, view, {}, seed);
  const PlaceMatch* best = nullptr;
  for (const FoundPlace& place : found) {
    if (place.match.verdict != PlaceVerdict::kAgrees) continue;
    if (!best || place.match.inliers > best->inliers) best = &place.match;
  }
  if (!best) return std::nullopt;
  for (const FoundPlace& place : found) {
    if (&place.match == best || place.match.verdict != PlaceVerdict::kAgrees) continue;
    if (rivals(*best, place.match)) return std::nullopt;
  }
  return *best;
}

}  // namespace ygslam
