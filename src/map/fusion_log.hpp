// What a weld of two places changed, so that it can be taken back.
#pragma once

#include <vector>

#include "map/map.hpp"

namespace ygslam {

struct FusionLog {
  /// A point where a keyframe that saw it has it: it stays there however the map is bent.
  struct Anchored {
    KeyframeId keyframe = kNoKeyframe;
    Vec3 p_camera = Vec3::Zero();
  };
  struct Fusion {
    MapPatch::Split undo;  ///< its position is that of `at`
    Anchored at;
    Anchored into_at;  ///< of the landmark that it went into, undo.from
  };

  std::vector<Fusion> fusions;               ///< in the order in which they were made
  std::vector<MapPatch::Observation> added;  ///< to landmarks that were there

  /// To be called before Map::fuse(from, into).
  void before_fusion(const Map& map, LandmarkId from, LandmarkId into) {
    const Landmark& l = map.landmark(from);
    fusions.push_back(
        {{from, into, l.p_world, l.first_keyframe, l.visible, l.found, l.observations},
         anchored(map, l),
         anchored(map, map.landmark(into))});
  }

 private:
  [[nodiscard]] static Anchored anchored(const Map& map, const Landmark& landmark) {
    const KeyframeId id = landmark.observations.front().keyframe;
    return {id, map.keyframe(id).T_camera_world * landmark.p_world};
  }
};

}  // namespace ygslam
