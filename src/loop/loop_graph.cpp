#include "loop/loop_graph.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <tuple>

#include "map/map_gravity.hpp"

namespace ygslam {
namespace {

// Standard deviations of the motion between two keyframes as mapped, and of one found by a loop.
// The first are generous: whether odometry allows a loop was asked before (LoopCloser); here loops
// are weighed against each other.
constexpr double kEdgeSigma_m = 0.02;
constexpr double kEdgeSigma_rad = 0.006;
constexpr double kLoopSigma_m = 0.01;
constexpr double kLoopSigma_rad = 0.003;

constexpr double kCoastedStds = 3;

Mat6 information(double sigma_m, double sigma_rad, double scale) {
  Vec6 diagonal;
  diagonal << Vec3::Constant(scale / (sigma_m * sigma_m)),
      Vec3::Constant(scale / (sigma_rad * sigma_rad));
  return diagonal.asDiagonal();
}

Mat6 information(const MapGraph::Edge& edge) {
  return edge.covariance ? Mat6(edge.covariance->inverse())
                         : information(kEdgeSigma_m, kEdgeSigma_rad, edge.information);
}

/// Of a camera that far away.
double coasted_m(const Mat6& covariance, double distance_m) {
  return kCoastedStds *
         std::sqrt(covariance.topLeftCorner<3, 3>().trace() +
                   distance_m * distance_m * covariance.bottomRightCorner<3, 3>().trace());
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

MapGraph make_map_graph(const Map& map, int min_shared) {
  MapGraph graph;
  graph.gravity = measured_gravity(map);
  const auto degree = [&](KeyframeId id) {
    return std::max<std::size_t>(1, map.keyframe(id).covisible.size());
  };
  const auto add = [&](KeyframeId from, KeyframeId to) {
    graph.edges.push_back({from, to, 2.0 / static_cast<double>(degree(from) + degree(to))});
  };
  for (const auto& [id, keyframe] : map.keyframes()) {
    graph.T_camera_world.emplace(id, keyframe.T_camera_world);
    if (keyframe.parent == kNoKeyframe) graph.roots.insert(id);
    const auto& covisible = keyframe.covisible;
    const auto& motion = keyframe.motion;
    // What was coasted is no motion as vision maps it.
    const KeyframeId parent = motion ? kNoKeyframe : keyframe.parent;
    const bool has_parent = map.has_keyframe(parent);
    if (has_parent && !covisible.contains(parent)) add(parent, id);
    for (const auto& [other, shared] : covisible)
      if (other < id && (shared >= min_shared || other == parent)) add(other, id);
    if (!motion) continue;
    const auto seen_from_both = covisible.find(motion->from);
    if (seen_from_both == covisible.end() || seen_from_both->second < min_shared)
      graph.edges.push_back({motion->from, id, 1, motion->covariance});
  }
  return graph;
}

Way least_drift_way(const MapGraph& graph, KeyframeId from, KeyframeId to, double drift_ratio) {
  struct Step {
    double drift_in_way_m;  // as if all of it came of the way's length
    KeyframeId id;
    Way way;
    bool operator>(const Step& other) const {
      return std::tie(drift_in_way_m, id) > std::tie(other.drift_in_way_m, other.id);
    }
  };
  std::map<KeyframeId, std::vector<std::pair<KeyframeId, const MapGraph::Edge*>>> next;
  for (const MapGraph::Edge& edge : graph.edges) {
    next[edge.from].emplace_back(edge.to, &edge);
    next[edge.to].emplace_back(edge.from, &edge);
  }
  const auto position = [&](KeyframeId id) { return graph.T_camera_world.at(id).inverse().t(); };
  std::set<KeyframeId> reached;
  std::priority_queue<Step, std::vector<Step>, std::greater<>> open;
  open.push({0, from, {}});
  while (!open.empty()) {
    const auto [so_far_m, id, way] = open.top();
    open.pop();
    if (!reached.insert(id).second) continue;
    if (id == to) return way;
    for (const auto& [other, edge] : next[id]) {
      if (reached.contains(other)) continue;
      const double length_m = (position(other) - position(id)).norm();
      const double more_m =
          edge->covariance
              ? coasted_m(*edge->covariance, (position(edge->to) - position(from)).norm())
              : 0;
      open.push({so_far_m + length_m + (more_m > 0 ? more_m / drift_ratio : 0),
                 other,
                 {way.length_m + length_m, way.coasted_m + more_m}});
    }
  }
  return {std::numeric_limits<double>::infinity(), 0};
}

WeighedLoops weigh_loops(const MapGraph& graph, std::span<const LoopEdge> loops,
                         const PoseGraphConfig& config) {
  PoseGraph problem;
  std::map<KeyframeId, std::uint32_t> node;
  for (const auto& [id, T_camera_world] : graph.T_camera_world) {
    node[id] = static_cast<std::uint32_t>(problem.T_camera_world.size());
    problem.T_camera_world.push_back(T_camera_world);
    problem.fixed.push_back(graph.roots.contains(id) ? 1 : 0);
  }
  for (const MapGraph::Edge& edge : graph.edges) {
    const SE3 T_to_from =
        graph.T_camera_world.at(edge.to) * graph.T_camera_world.at(edge.from).inverse();
    problem.edges.push_back(
        {node.at(edge.from), node.at(edge.to), T_to_from, information(edge), false});
  }
  for (const LoopEdge& loop : loops)
    problem.edges.push_back({node.at(loop.from), node.at(loop.to), loop.T_to_from,
                             information(kLoopSigma_m, kLoopSigma_rad, 1), true});
  for (auto [id, direction] : graph.gravity) {
    direction.pose = node.at(id);
    problem.directions.push_back(direction);
  }
  const PoseGraphResult solved = optimize_pose_graph(problem, config);
  WeighedLoops result;
  result.stretch = largest_residual(problem, solved);
  for (const auto& [id, i] : node) result.T_camera_world[id] = solved.T_camera_world[i];
  for (const double weight : std::span(solved.edge_weight).last(loops.size()))
    result.kept.push_back(weight > 0.5 ? 1 : 0);
  return result;
}

}  // namespace ygslam
