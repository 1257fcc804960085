// Features found anew, at which no flow ends, are taken for what the followed points around them
// are: a vote of the nearest neighbours at the same depth.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "motion/flow/flow_field.hpp"

namespace ygslam {

/// @param nearest per feature the flow end at it, -1 = none; the others are returned as they are.
/// @param moves per followed point, 1 = seen to move.
/// @param majority share of the neighbours' votes that must agree.
/// @return nearest, and for features without one the nearest followed point of the majority around
/// them at their depth (-1 where the neighbours disagree or there are none).
[[nodiscard]] std::vector<std::int32_t> vote_of_neighbours(const Features& features,
                                                           std::span<const std::int32_t> nearest,
                                                           std::span<const std::uint8_t> moves,
                                                           const FlowField& field, double majority);

/// Per followed point the share of its neighbours' votes that move as well, -1 where it has fewer
/// than two neighbours. A mover moves as a whole; a lone violator is a bad flow or a bad depth.
[[nodiscard]] std::vector<float> moving_share(std::span<const std::uint8_t> moves,
                                              const FlowField& field);

}  // namespace ygslam
