#include "loop/loop_closer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <set>

namespace ygslam {
namespace {

constexpr double kAgreeM = 0.1;  // covisible keyframes place the pose within this
constexpr double kAgreeRad = 0.05;
constexpr std::size_t kNeighbours = 5;
constexpr std::size_t kPlaceKeyframes = 10;  // besides the one found, to be fused

// Standard deviations of the motion between two keyframes as mapped, and of one found by a loop.
// The first are generous: whether odometry allows a loop was asked before (check_drift); here loops
// are weighed against each other.
constexpr double kEdgeSigmaM = 0.02;
constexpr double kEdgeSigmaRad = 0.006;
constexpr double kLoopSigmaM = 0.01;
constexpr double kLoopSigmaRad = 0.003;
constexpr double kMaxStretch = 3;  // standard deviations

PlaceView view_of(const Keyframe& keyframe) {
  return {*keyframe.data->features, keyframe.data->grid, keyframe.static_weight,
          &keyframe.data->free_space};
}

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

/// Length of the shortest way between two keyframes over parents and shared landmarks (Dijkstra).
double path_m(const Map& map, KeyframeId from, KeyframeId to, int min_shared) {
  using Entry = std::pair<double, KeyframeId>;
  std::map<KeyframeId, std::vector<KeyframeId>> children;
  for (const auto& [id, keyframe] : map.keyframes()) children[keyframe.parent].push_back(id);
  std::map<KeyframeId, double> shortest_m;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  open.emplace(0.0, from);
  while (!open.empty()) {
    const auto [so_far_m, id] = open.top();
    open.pop();
    if (!shortest_m.emplace(id, so_far_m).second) continue;
    if (id == to) return so_far_m;
    const Keyframe& keyframe = map.keyframe(id);
    const Vec3 position = keyframe.position_world();
    const auto go = [&](KeyframeId next) {
      if (!map.has_keyframe(next) || shortest_m.contains(next)) return;
      open.emplace(so_far_m + (map.keyframe(next).position_world() - position).norm(), next);
    };
    go(keyframe.parent);
    for (const KeyframeId child : children[id]) go(child);
    for (const auto& [other, shared] : keyframe.covisible)
      if (shared >= min_shared) go(other);
  }
  return std::numeric_limits<double>::infinity();
}

bool same_pose(const SE3& T_a_world, const SE3& T_b_world, double within_m, double within_rad) {
  const SE3 T_a_b = T_a_world * T_b_world.inverse();
  return T_a_b.t().norm() < within_m && T_a_b.angle() < within_rad;
}

Mat6 information(double sigma_m, double sigma_rad, double scale) {
  Vec6 diagonal;
  diagonal << Vec3::Constant(scale / (sigma_m * sigma_m)),
      Vec3::Constant(scale / (sigma_rad * sigma_rad));
  return diagonal.asDiagonal();
}

/// Of the edges that count, in standard deviations.
double largest_residual(const PoseGraph& graph, const PoseGraphResult& solved) {
  double largest = 0;
  for (std::size_t i = 0; i < graph.edges.size(); ++i) {
    const PoseGraphEdge& edge = graph.edges[i];
    if (solved.edge_weight[i] <= 0.5) continue;
    const Vec6 residual =
        pose_graph_residual(edge, solved.T_camera_world[edge.from], solved.T_camera_world[edge.to]);
    largest = std::max(largest, std::sqrt(residual.dot(edge.information * residual) / 6));
  }
  return largest;
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

LoopCloser::LoopCloser(const LoopConfig& config, const Camera& camera)
    : config_(config), finder_(config.finder, camera) {}

LoopResult LoopCloser::step(const Map& map, const PlaceIndex& index, KeyframeId id) {
  LoopResult result;
  if (!map.has_keyframe(id)) return result;
  const Keyframe& keyframe = map.keyframe(id);
  const auto near = near_in_graph(map, id, config_.min_shared);
  for (FoundPlace& place : finder_.find(map, index, view_of(keyframe), near, ygslam::index(id))) {
    LoopAttempt attempt;
    attempt.keyframe = id;
    attempt.stamp = keyframe.data->stamp;
    attempt.place_stamp = map.keyframe(place.match.place).data->stamp;
    attempt.score = place.score;
    attempt.match = place.match;
    if (attempt.match.verdict == PlaceVerdict::kAgrees) check_drift(map, attempt);
    result.attempts.push_back(attempt);
  }
  if (LoopAttempt* best = choose(result.attempts)) result.closure = close(map, *best);
  return result;
}

/// Sets the outcome to kAlone where odometry could have drifted so far.
void LoopCloser::check_drift(const Map& map, LoopAttempt& attempt) const {
  const SE3& T_now = map.keyframe(attempt.keyframe).T_camera_world;
  const SE3& T_found = attempt.match.T_camera_world;
  attempt.path_m = path_m(map, attempt.keyframe, attempt.match.place, config_.min_shared);
  attempt.correction_m = (T_now.inverse().t() - T_found.inverse().t()).norm();
  attempt.correction_rad = (T_now * T_found.inverse()).angle();
  const double drift_m = config_.max_drift_m + config_.max_drift_ratio * attempt.path_m;
  const bool possible =
      attempt.correction_m <= drift_m && attempt.correction_rad <= config_.max_drift_rad;
  attempt.outcome = possible ? LoopOutcome::kAlone : LoopOutcome::kTooFar;
  // Where no way leads from one view to the other odometry vouches for nothing.
  if (!std::isfinite(attempt.path_m)) attempt.outcome = LoopOutcome::kOtherSubmap;
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

std::optional<LoopClosure> LoopCloser::close(const Map& map, LoopAttempt& attempt) {
  std::vector<LoopEdge> loops = agreeing_edges(map, attempt);
  attempt.agreeing = static_cast<int>(loops.size()) - 1;
  attempt.outcome = LoopOutcome::kAlone;
  if (attempt.agreeing < config_.min_agreeing) return std::nullopt;
  std::erase_if(loops_, [&](const LoopEdge& loop) {
    return !map.has_keyframe(loop.from) || !map.has_keyframe(loop.to);
  });
  attempt.outcome = LoopOutcome::kInconsistent;
  auto patch = correction(map, loops, attempt);
  if (!patch) return std::nullopt;
  attempt.outcome = LoopOutcome::kClosed;
  const KeyframeId place = attempt.match.place;
  LoopClosure closure{std::move(*patch), {}, {place}};
  for (const KeyframeId id : map.covisible(place, config_.min_shared, kPlaceKeyframes))
    closure.place.push_back(id);
  for (const LoopEdge& loop : loops) closure.window.push_back(loop.to);
  loops_.insert(loops_.end(), loops.begin(), loops.end());
  return closure;
}

/// The keyframe's own edge first, then those of covisible keyframes that find the place where the
/// keyframe's pose puts it.
std::vector<LoopCloser::LoopEdge> LoopCloser::agreeing_edges(const Map& map,
                                                             const LoopAttempt& attempt) const {
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
    if (!same_pose(match.T_camera_world, T_guess, kAgreeM, kAgreeRad)) continue;
    edges.push_back({place, id, match.T_camera_world * T_place_world.inverse()});
  }
  return edges;
}

/// Spreads the loops' errors over the map. @return nullopt if it would have to stretch too far.
std::optional<MapPatch> LoopCloser::correction(const Map& map, const std::vector<LoopEdge>& loops,
                                               LoopAttempt& attempt) const {
  PoseGraph graph;
  std::map<KeyframeId, std::uint32_t> node;
  for (const auto& [id, keyframe] : map.keyframes()) {
    node[id] = static_cast<std::uint32_t>(graph.T_camera_world.size());
    graph.T_camera_world.push_back(keyframe.T_camera_world);
    graph.fixed.push_back(keyframe.parent == kNoKeyframe ? 1 : 0);
  }
  // Edges side by side rest on the same landmarks: all of a keyframe count as much as one.
  const auto degree = [&](KeyframeId id) {
    return std::max<std::size_t>(1, map.keyframe(id).covisible.size());
  };
  const auto add_as_mapped = [&](KeyframeId from, KeyframeId to) {
    const SE3 T_to_from =
        map.keyframe(to).T_camera_world * map.keyframe(from).T_camera_world.inverse();
    const double scale = 2.0 / static_cast<double>(degree(from) + degree(to));
    graph.edges.push_back({node.at(from), node.at(to), T_to_from,
                           information(kEdgeSigmaM, kEdgeSigmaRad, scale), false});
  };
  for (const auto& [id, keyframe] : map.keyframes()) {
    const auto& covisible = keyframe.covisible;
    const bool has_parent = map.has_keyframe(keyframe.parent);
    if (has_parent && !covisible.contains(keyframe.parent)) add_as_mapped(keyframe.parent, id);
    for (const auto& [other, shared] : covisible)
      if (other < id && (shared >= config_.min_shared || other == keyframe.parent))
        add_as_mapped(other, id);
  }
  const auto add_loop = [&](const LoopEdge& loop) {
    graph.edges.push_back({node.at(loop.from), node.at(loop.to), loop.T_to_from,
                           information(kLoopSigmaM, kLoopSigmaRad, 1), true});
  };
  for (const LoopEdge& loop : loops_) add_loop(loop);
  for (const LoopEdge& loop : loops) add_loop(loop);

  const PoseGraphResult solved = optimize_pose_graph(graph, config_.graph);
  attempt.stretch = largest_residual(graph, solved);
  const auto is_kept = [](double weight) { return weight > 0.5; };
  const auto of_new_loops = std::span(solved.edge_weight).last(loops.size());
  const bool kept = std::all_of(of_new_loops.begin(), of_new_loops.end(), is_kept);
  if (!kept || attempt.stretch > kMaxStretch) return std::nullopt;
  MapPatch patch = map.start_patch();
  for (const auto& [id, i] : node)
    patch.poses.push_back({id, graph.T_camera_world[i], solved.T_camera_world[i].normalized()});
  return patch;
}

}  // namespace ygslam
