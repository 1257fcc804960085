// Depth that fails, which the people network knows nothing of.
#pragma once

#include <span>
#include <vector>

#include "image/image.hpp"
#include "segment/people_input.hpp"

namespace ygslam {

/// The network takes depth that fails for a person right before the lens: it knows no other holes.
/// Nobody is in a hole with straight edges, nor in any where hardly anything is measured.
/// @param logits kPeopleRows x kPeopleColumns. @param cells_m depth of the cells, 0 = not measured.
/// @return the logits, with nobody in outages.
[[nodiscard]] std::vector<float> without_outages(std::span<const float> logits,
                                                 const DepthImage& cells_m, const PeopleGrid& grid);

}  // namespace ygslam
