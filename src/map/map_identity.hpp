// What tells one map from all others, as long as it goes on: in memory, in its file, and in what
// lies beside the file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "map/keyframe.hpp"

namespace ygslam {

/// 128 bits, as a UUID has (RFC 9562).
struct MapIdentity {
  std::uint64_t high = 0, low = 0;
  bool operator==(const MapIdentity&) const = default;
};

/// No two are the same (UUID version 4).
[[nodiscard]] MapIdentity random_identity();
/// The same for the same keyframe, another for any other (UUID version 8).
[[nodiscard]] MapIdentity identity_of(const KeyframeData& first);

/// 6ba7b810-9dad-41d1-80b4-00c04fd430c8
[[nodiscard]] std::string to_string(const MapIdentity& identity);
/// Nothing where it is written otherwise than to_string() does.
[[nodiscard]] std::optional<MapIdentity> parse_identity(std::string_view text);

/// Of what a keyframe shows, whatever corrections did to where it shows it: keyframes of one number
/// and stamp are told apart by it.
[[nodiscard]] std::uint64_t sight_of(const KeyframeData& keyframe);

}  // namespace ygslam
