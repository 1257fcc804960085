// To a network two who touch are often one instance, and one behind a table or a box is several.
// Where somebody was a moment ago tells how to split and to merge them.
#pragma once

#include <vector>

#include "objects/association.hpp"

namespace ygslam {

struct SplitInstances {
  std::vector<InstanceView> instances;
  GreyImage ids;  ///< the mask's; each part has a value of its own
};

/// A person that covers several tracks seen a moment ago becomes one for each of them, less sure
/// where it shows little of a body. What is before them and out of their reach is a part, too.
/// @param frame the mask's own.
[[nodiscard]] SplitInstances split_merged_instances(std::vector<InstanceView> instances,
                                                    GreyImage ids, const ObjectFrame& frame,
                                                    const Tracks& tracks, const Camera& camera);

/// Instances at the place of one track seen a moment ago become one: one above the other, or within
/// what the track filled while nothing hid it (either side of who passes before it).
[[nodiscard]] SplitInstances merge_fragments(SplitInstances seen, const ObjectFrame& frame,
                                             const Tracks& tracks, const Camera& camera);

}  // namespace ygslam
