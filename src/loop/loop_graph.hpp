// Keyframes and what ties them to each other, as the pose graph and the way between two places see
// them.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "map/map.hpp"
#include "optim/pose_graph.hpp"

namespace ygslam {

/// Between two keyframes of the map, measured by their views of one place.
struct LoopEdge {
  KeyframeId from = kNoKeyframe;
  KeyframeId to = kNoKeyframe;
  SE3 T_to_from;
};

/// The keyframes as they are mapped.
struct MapGraph {
  struct Edge {
    KeyframeId from = kNoKeyframe;
    KeyframeId to = kNoKeyframe;
    double information = 1;  ///< edges side by side rest on the same landmarks: each counts less
    /// Of exp(error) T_to_from [m, rad]: nothing was seen between the two (KeyframeMotion).
    std::optional<Mat6> covariance{};
  };
  std::map<KeyframeId, SE3> T_camera_world;
  std::set<KeyframeId> roots;
  std::vector<Edge> edges;  ///< parents or motions, and keyframes that share landmarks
  std::map<KeyframeId, MeasuredDirection> gravity{};  ///< measured_gravity()
};

/// @param min_shared landmarks that make an edge.
[[nodiscard]] MapGraph make_map_graph(const Map& map, int min_shared);

struct Way {
  double length_m = 0;   ///< infinite: there is none
  double coasted_m = 0;  ///< what motions without vision on it may have moved its start, by their
                         ///< covariances: three standard deviations
};
/// The way between two keyframes on which drift is least (Dijkstra).
/// @param drift_ratio of its length.
[[nodiscard]] Way least_drift_way(const MapGraph& graph, KeyframeId from, KeyframeId to,
                                  double drift_ratio);

/// Loops weighed against the graph and each other.
struct WeighedLoops {
  std::map<KeyframeId, SE3> T_camera_world;
  std::vector<std::uint8_t> kept;  ///< per loop
  double stretch = 0;  ///< largest residual of an edge that counts, in standard deviations
};
[[nodiscard]] WeighedLoops weigh_loops(const MapGraph& graph, std::span<const LoopEdge> loops,
                                       const PoseGraphConfig& config);

}  // namespace ygslam
