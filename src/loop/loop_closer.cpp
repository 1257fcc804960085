#include "loop/loop_closer.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <set>
#include <span>

#include "core/trace.hpp"

namespace ygslam {
namespace {

constexpr double kAgree_m = 0.1;  // covisible keyframes place the pose within this
constexpr double kAgree_rad = 0.05;
constexpr std::size_t kNeighbours = 5;
constexpr std::size_t kPlaceKeyframes = 10;  // besides the one found, to be fused

constexpr double kMaxStretch = 3;  // standard deviations

/// A keyframe, those that share landmarks with it, and those that share some with these.
std::vector<KeyframeId> near_in_graph(const Map& map, KeyframeId keyframe, int min_shared) {
  std::set<KeyframeId> near = {keyframe};
  const std::size_t all = map.keyframes().size();
  for (const KeyframeId id : map.covisible(keyframe, min_shared, all)) {
    near.insert(id);
    for (const KeyframeId next : map.covisible(id, min_shared, all)) near.insert(next);
  }
  return {near.begin(), near.end()};
}

bool same_pose(const SE3& T_a_world, const SE3& T_b_world, double within_m, double within_rad) {
  const SE3 T_a_b = T_a_world * T_b_world.inverse();
  return T_a_b.t().norm() < within_m && T_a_b.angle() < within_rad;
}

}  // namespace

const char* to_string(LoopOutcome outcome) {
  switch (outcome) {
    case LoopOutcome::kRefused:
      return "refused";
    case LoopOutcome::kTooFar:
      return "too far";
    case LoopOutcome::kOtherSubmap:
      return "other submap";
    case LoopOutcome::kAmbiguous:
      return "ambiguous";
    case LoopOutcome::kAlone:
      return "alone";
    case LoopOutcome::kInconsistent:
      return "inconsistent";
    case LoopOutcome::kClosed:
      return "closed";
  }
  return "?";
}

void append_attempts(std::span<const LoopAttempt> tried, std::size_t most,
                     std::vector<LoopAttempt>& attempts) {
  std::copy_if(tried.begin(), tried.end(), std::back_inserter(attempts),
               [&](const LoopAttempt& attempt) {
                 return attempts.size() < most || attempt.outcome == LoopOutcome::kClosed;
               });
}

LoopCloser::LoopCloser(const LoopConfig& config, const Camera& camera)
    : config_(config), camera_(camera), finder_(config.finder, camera) {}

LoopResult LoopCloser::step(const Map& map, const PlaceIndex& index, KeyframeId id) {
  const trace::Span span("place search");
  LoopResult result;
  if (!map.has_keyframe(id)) return result;
  const Keyframe& keyframe = map.keyframe(id);
  std::optional<MapGraph> graph;  // of use only where a place agrees
  const auto near = near_in_graph(map, id, config_.min_shared);
  for (FoundPlace& place : finder_.find(map, index, view_of(keyframe), near, ygslam::index(id))) {
    LoopAttempt attempt;
    attempt.keyframe = id;
    attempt.stamp = keyframe.data->stamp;
    attempt.place_stamp = map.keyframe(place.match.place).data->stamp;
    attempt.score = place.score;
    attempt.match = place.match;
    attempt.T_keyframe_place =
        place.match.T_camera_world * map.keyframe(place.match.place).T_camera_world.inverse();
    if (attempt.match.verdict == PlaceVerdict::kAgrees) {
      if (!graph) graph = make_map_graph(map, config_.min_shared);
      check_drift(*graph, attempt);
    }
    result.attempts.push_back(attempt);
  }
  if (!graph) return result;
  follow_removed_keyframes(map);
  if (LoopAttempt* best = choose(result.attempts)) result.closure = close(map, *graph, *best);
  return result;
}

/// Their places in the map are known from those they stood beside.
void LoopCloser::follow_removed_keyframes(const Map& map) {
  for (LoopEdge& edge : closed_) {
    const KeyframeId from = map.nearest_kept(edge.from);
    const KeyframeId to = map.nearest_kept(edge.to);
    const SE3 T_from_kept =
        map.resolved_pose(edge.from) * map.keyframe(from).T_camera_world.inverse();
    const SE3 T_to_kept = map.resolved_pose(edge.to) * map.keyframe(to).T_camera_world.inverse();
    if (from != edge.from || to != edge.to)
      edge = {from, to, T_to_kept.inverse() * edge.T_to_from * T_from_kept};
  }
  std::erase_if(closed_, [](const LoopEdge& edge) { return edge.from == edge.to; });
}

/// Sets the outcome to kAlone where odometry could have drifted so far.
void LoopCloser::check_drift(const MapGraph& graph, LoopAttempt& attempt) const {
  const SE3& T_now = graph.T_camera_world.at(attempt.keyframe);
  const SE3 T_found = attempt.T_keyframe_place * graph.T_camera_world.at(attempt.match.place);
  const Way way =
      least_drift_way(graph, attempt.keyframe, attempt.match.place, config_.max_drift_ratio);
  attempt.path_m = way.length_m;
  attempt.coasted_m = way.coasted_m;
  attempt.correction_m = (T_now.inverse().t() - T_found.inverse().t()).norm();
  attempt.correction_rad = (T_now * T_found.inverse()).angle();
  attempt.outcome = strain(attempt) <= 1 ? LoopOutcome::kAlone : LoopOutcome::kTooFar;
  // Where no way leads from one view to the other odometry vouches for nothing.
  if (!std::isfinite(attempt.path_m)) attempt.outcome = LoopOutcome::kOtherSubmap;
}

/// The correction in parts of the drift that odometry may have.
double LoopCloser::strain(const LoopAttempt& attempt) const {
  const double drift_m =
      config_.max_drift_m + config_.max_drift_ratio * attempt.path_m + attempt.coasted_m;
  return std::max(attempt.correction_m / drift_m, attempt.correction_rad / config_.max_drift_rad);
}

/// The attempt with most inliers of those that odometry allows; null if none, or if another place
/// fits about as well.
LoopAttempt* LoopCloser::choose(std::vector<LoopAttempt>& attempts) const {
  LoopAttempt* best = nullptr;
  for (LoopAttempt& attempt : attempts) {
    if (attempt.outcome != LoopOutcome::kAlone) continue;
    if (!best || attempt.match.inliers > best->match.inliers) best = &attempt;
  }
  if (!best) return nullptr;
  for (LoopAttempt& other : attempts) {
    if (&other == best || other.outcome != LoopOutcome::kAlone) continue;
    if (!finder_.rivals(best->match, other.match)) continue;
    best->outcome = other.outcome = LoopOutcome::kAmbiguous;
    return nullptr;
  }
  return best;
}

std::optional<LoopClosure> LoopCloser::close(const Map& map, const MapGraph& graph,
                                             LoopAttempt& attempt) {
  const trace::Span span("pose graph");
  const std::vector<LoopEdge> edges = agreeing_edges(map, attempt);
  attempt.agreeing = static_cast<int>(edges.size()) - 1;
  attempt.outcome = LoopOutcome::kAlone;
  if (attempt.agreeing < config_.min_agreeing) return std::nullopt;
  attempt.outcome = LoopOutcome::kInconsistent;
  std::vector<LoopEdge> all = closed_;
  all.insert(all.end(), edges.begin(), edges.end());
  const WeighedLoops weighed = weigh_loops(graph, all, config_.graph);
  attempt.stretch = weighed.stretch;
  if (!std::ranges::all_of(std::span(weighed.kept).last(edges.size()), std::identity{}) ||
      weighed.stretch > kMaxStretch)
    return std::nullopt;
  attempt.outcome = LoopOutcome::kClosed;
  closed_ = std::move(all);
  return closure_of(map, graph, weighed, attempt, edges);
}

/// The keyframe's own edge first, then those of covisible keyframes that find the place where the
/// keyframe's pose puts it.
std::vector<LoopEdge> LoopCloser::agreeing_edges(const Map& map, const LoopAttempt& attempt) const {
  const KeyframeId place = attempt.match.place;
  const SE3& T_place_world = map.keyframe(place).T_camera_world;
  const SE3 T_place_keyframe = T_place_world * attempt.match.T_camera_world.inverse();
  std::vector<LoopEdge> edges = {{place, attempt.keyframe, T_place_keyframe.inverse()}};
  const SE3 T_world_keyframe = map.keyframe(attempt.keyframe).T_camera_world.inverse();
  for (const KeyframeId id : map.covisible(attempt.keyframe, config_.min_shared, kNeighbours)) {
    const Keyframe& neighbour = map.keyframe(id);
    const SE3 T_guess = neighbour.T_camera_world * T_world_keyframe * attempt.match.T_camera_world;
    const PlaceMatch match =
        finder_.verifier().verify_near(map, view_of(neighbour), place, T_guess);
    if (match.verdict != PlaceVerdict::kAgrees) continue;
    if (!same_pose(match.T_camera_world, T_guess, kAgree_m, kAgree_rad)) continue;
    edges.push_back({place, id, match.T_camera_world * T_place_world.inverse()});
  }
  return edges;
}

LoopClosure LoopCloser::closure_of(const Map& map, const MapGraph& graph,
                                   const WeighedLoops& weighed, const LoopAttempt& attempt,
                                   const std::vector<LoopEdge>& edges) const {
  LoopClosure closure;
  closure.patch = map.start_patch();
  for (const auto& [id, T_camera_world] : graph.T_camera_world)
    closure.patch.poses.push_back({id, T_camera_world, weighed.T_camera_world.at(id).normalized()});
  closure.place = map.with_covisible(attempt.match.place, config_.min_shared, kPlaceKeyframes);
  std::set<KeyframeId> window;
  for (const LoopEdge& edge : edges)
    if (window.insert(edge.to).second) closure.window.push_back(edge.to);
  return closure;
}

}  // namespace ygslam
