// Taking a loop back: the map as it would be if the loop had not been closed.
#pragma once

#include "geometry/camera.hpp"
#include "map/fusion_log.hpp"
#include "map/map.hpp"

namespace ygslam {

/// What closing a loop did to the map.
struct LoopEffect {
  MapPatch undo;      ///< of its patch: poses alone
  FusionLog fusions;  ///< of its weld
};

/// The opposite of a patch that was just applied: back to where the keyframes came from.
[[nodiscard]] MapPatch inverse_poses(const MapPatch& patch);

/// An adjustment that followed the loop is part of what the loop did: it is taken back as well.
void add_adjustment(LoopEffect& effect, const MapPatch& adjustment);

/// Keyframes go back to where they were, those made since go with their parents. What the weld
/// fused is made again. What was seen since goes to the landmark that it shows, which may be a new
/// one.
[[nodiscard]] MapPatch make_revocation(const Map& map, const Camera& camera,
                                       const LoopEffect& effect);

}  // namespace ygslam
