// The loop closing stage: a keyframe in, what it was compared with and the correction of the map
// out (Mur-Artal, Tardos 2017, sec. III-C; the checks are explained in docs/loops.md).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "loop/loop_graph.hpp"
#include "loop/place_finder.hpp"

namespace ygslam {

struct LoopConfig {
  PlaceIndexConfig index;
  PlaceFinderConfig finder;
  PoseGraphConfig graph;
  int min_agreeing = 2;  ///< covisible keyframes that must find the same place
  /// The map cannot be wrong by more than this: a part of the way between the two views, and what
  /// coasting on it may have erred.
  double max_drift_m = 0.1;
  double max_drift_ratio = 0.02;
  double max_drift_rad = 0.35;
  int min_shared = 15;  ///< landmarks that make an edge of the pose graph
};

enum class LoopOutcome : std::uint8_t {
  kRefused,       ///< by the verdict on the place
  kTooFar,        ///< odometry cannot have drifted so far
  kOtherSubmap,   ///< no odometry leads there (yet): see SubmapJoiner
  kAmbiguous,     ///< another place fits as well
  kAlone,         ///< keyframes beside this one do not agree (yet)
  kInconsistent,  ///< the pose graph would have to stretch too far
  kClosed,
};
[[nodiscard]] const char* to_string(LoopOutcome outcome);

/// One row of `loops.csv`.
struct LoopAttempt {
  KeyframeId keyframe = kNoKeyframe;
  Timestamp stamp;
  Timestamp place_stamp;  ///< of match.place, which may be gone when the run ends
  double score = 0;       ///< of the place index
  PlaceMatch match;
  SE3 T_keyframe_place;  ///< as match has it
  LoopOutcome outcome = LoopOutcome::kRefused;
  double path_m = 0;        ///< along the map between the two views
  double coasted_m = 0;     ///< what coasting on it may have erred: Way::coasted_m
  double correction_m = 0;  ///< how far the keyframe would move ...
  double correction_rad = 0;
  int agreeing = 0;    ///< covisible keyframes
  double stretch = 0;  ///< largest residual of an edge of the pose graph, in standard deviations
};

/// Appends what was tried. Once there are `most`, only loops that were closed are kept.
void append_attempts(std::span<const LoopAttempt> tried, std::size_t most,
                     std::vector<LoopAttempt>& attempts);

/// To be carried out in this order.
struct LoopClosure {
  MapPatch patch;
  std::vector<KeyframeId> window;  ///< keyframes that see the place ...
  std::vector<KeyframeId> place;   ///< ... and those of the place: to be fused
};

struct LoopResult {
  std::vector<LoopAttempt> attempts;
  std::optional<LoopClosure> closure;
};

class LoopCloser {
 public:
  LoopCloser(const LoopConfig& config, const Camera& camera);

  /// @param keyframe mapped, and rid of moving things by its mask where masks are expected.
  [[nodiscard]] LoopResult step(const Map& map, const PlaceIndex& index, KeyframeId keyframe);

 private:
  void follow_removed_keyframes(const Map& map);
  void check_drift(const MapGraph& graph, LoopAttempt& attempt) const;
  [[nodiscard]] double strain(const LoopAttempt& attempt) const;
  [[nodiscard]] LoopAttempt* choose(std::vector<LoopAttempt>& attempts) const;
  [[nodiscard]] std::optional<LoopClosure> close(const Map& map, const MapGraph& graph,
                                                 LoopAttempt& attempt);
  [[nodiscard]] std::vector<LoopEdge> agreeing_edges(const Map& map,
                                                     const LoopAttempt& attempt) const;
  [[nodiscard]] LoopClosure closure_of(const Map& map, const MapGraph& graph,
                                       const WeighedLoops& weighed, const LoopAttempt& attempt,
                                       const std::vector<LoopEdge>& edges) const;

  LoopConfig config_;
  const Camera& camera_;
  PlaceFinder finder_;
  std::vector<LoopEdge> closed_;  // of all loops so far
};

}  // namespace ygslam
