// Moving points without a mask: which of them are one thing.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace ygslam {

struct ObjectPoint;

inline constexpr int kMinMoverPoints = 8;  ///< that move together, to be a thing

/// Members (indices into points) in groups connected by nearness in the image and in depth.
[[nodiscard]] std::vector<std::vector<std::uint32_t>> connected_groups(
    std::span<const ObjectPoint> points, std::span<const std::uint32_t> members);

}  // namespace ygslam
