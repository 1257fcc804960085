// Which colour image belongs to which depth image, from their stamps.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/time.hpp"

namespace ygslam {

/// Pairs farther apart than this are not taken (the customary figure of the TUM tools).
inline constexpr std::int64_t kMaxPairDifference_ns = 20'000'000;

struct StampPair {
  std::size_t first = 0, second = 0;  ///< positions in the two lists
  bool operator==(const StampPair&) const = default;
};

/// One to one, nearest first: again and again the two free stamps that lie closest together (on a
/// tie the earlier), as long as they are within max_difference_ns.
/// @param first,second strictly increasing. @return in order of time. O(n log n).
[[nodiscard]] std::vector<StampPair> pair_one_to_one(std::span<const Timestamp> first,
                                                     std::span<const Timestamp> second,
                                                     std::int64_t max_difference_ns);

/// The clock offset second - first [ns] under which most stamps coincide (within 2 ms), searched in
/// +-0.5 s; on a tie the smallest. Stamps strictly increasing. @return nullopt if less than half of
/// them do: nothing is near, or each clock has its own rate and they only pass each other.
[[nodiscard]] std::optional<std::int64_t> estimate_offset_ns(std::span<const Timestamp> first,
                                                             std::span<const Timestamp> second);

}  // namespace ygslam
