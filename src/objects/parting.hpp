// Two who touch, or stand one behind the other, are often one instance to a network. Who was seen
// apart before tells how to part it.
#pragma once

#include <vector>

#include "objects/association.hpp"

namespace ygslam {

struct PartedInstances {
  std::vector<InstanceView> instances;
  GreyImage ids;  ///< the mask's, where each part has a value of its own
};

/// An instance that covers several tracks seen a moment ago becomes one for each of them.
/// @param frame the mask's own.
[[nodiscard]] PartedInstances part_by_tracks(std::vector<InstanceView> instances, GreyImage ids,
                                             const ObjectFrame& frame, const Tracks& tracks,
                                             const Camera& camera);

}  // namespace ygslam
