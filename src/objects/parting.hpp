// To a network two who touch are often one instance, and one behind a table or a box is several.
// Where somebody was a moment ago tells how to part and to join them.
#pragma once

#include <vector>

#include "objects/association.hpp"

namespace ygslam {

struct PartedInstances {
  std::vector<InstanceView> instances;
  GreyImage ids;  ///< the mask's; each part has a value of its own
};

/// An instance that covers several tracks seen a moment ago becomes one for each of them.
/// @param frame the mask's own.
[[nodiscard]] PartedInstances part_by_tracks(std::vector<InstanceView> instances, GreyImage ids,
                                             const ObjectFrame& frame, const Tracks& tracks,
                                             const Camera& camera);

/// Instances one above the other at the place of one track seen a moment ago become one.
[[nodiscard]] PartedInstances join_by_tracks(PartedInstances seen, const ObjectFrame& frame,
                                             const Tracks& tracks, const Camera& camera);

}  // namespace ygslam
