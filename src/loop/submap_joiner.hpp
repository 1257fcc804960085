// Finds out where a submap, begun after a loss, lies in the world: views of the one that show
// places of the other. Where the camera can have come by itself while it was lost, two that agree
// will do; otherwise no odometry speaks for or against them, and they must be as many and as
// independent as for a merge of two maps.
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "loop/loop_closer.hpp"
#include "loop/map_alignment.hpp"

namespace ygslam {

struct SubmapJoin {
  KeyframeId root = kNoKeyframe;    ///< of the submap that moves, the younger one
  KeyframeId parent = kNoKeyframe;  ///< of the other, for Map::join()
  MapPatch patch;                   ///< moves its keyframes
  std::vector<MapPair> pairs;       ///< that agree on it: to be fused
};

class SubmapJoiner {
 public:
  explicit SubmapJoiner(const MapAlignmentConfig& config) : config_(config) {}

  /// A submap begins. @param reach_m so far the camera can have come from where the submap is said
  /// to begin; 0: nobody knows.
  void begin(KeyframeId root, double reach_m) { reach_m_[root] = reach_m; }
  /// @param attempts of one keyframe to recognise a place.
  [[nodiscard]] std::optional<SubmapJoin> step(const Map& map,
                                               std::span<const LoopAttempt> attempts);
  /// The same of a frame. @param T_camera_reference its pose. @param match that agrees.
  [[nodiscard]] std::optional<SubmapJoin> step(const Map& map, KeyframeId reference,
                                               const SE3& T_camera_reference,
                                               const PlaceMatch& match);

 private:
  /// One camera in two submaps.
  struct CommonView {
    KeyframeId in_younger = kNoKeyframe;
    KeyframeId in_older = kNoKeyframe;
    SE3 T_camera_younger;  ///< to the keyframes, not to the world
    SE3 T_camera_older;
    int inliers = 0;
  };
  void remember(const Map& map, KeyframeId reference, const SE3& T_camera_reference,
                const PlaceMatch& match);
  void forget_what_is_gone(const Map& map);
  [[nodiscard]] std::vector<MapPair> pairs_of_latest(const Map& map) const;
  [[nodiscard]] bool is_within_reach(const Map& map, KeyframeId root,
                                     const MapAlignment& alignment) const;
  [[nodiscard]] std::optional<SubmapJoin> try_latest(const Map& map) const;

  MapAlignmentConfig config_;
  std::deque<CommonView> common_views_;  // both ends in the map, in submaps that are not joined
  std::map<KeyframeId, double> reach_m_;
};

}  // namespace ygslam
