// Columns of numbers that follow from others nearly always: what they have more is kept.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "map/archive.hpp"

namespace ygslam::map_fields {

/// Small steps up and down as small numbers: 0, -1, 1, -2, ... become 0, 1, 2, 3, ...
template <typename Unsigned>
[[nodiscard]] constexpr Unsigned zigzag(Unsigned step) {
  constexpr int kTop = 8 * sizeof(Unsigned) - 1;
  return static_cast<Unsigned>((step << 1) ^ (Unsigned{0} - (step >> kTop)));
}
template <typename Unsigned>
[[nodiscard]] constexpr Unsigned unzigzag(Unsigned code) {
  return static_cast<Unsigned>((code >> 1) ^ (Unsigned{0} - (code & 1)));
}

/// value(i) as its distance from guess(i), counted in floating-point numbers: exact whatever the
/// guess is, and where another build of the program guesses by one bit otherwise, off by that bit.
/// @param guess must not depend on value.
template <typename Archive, typename Value, typename Guess>
void guessed_column(Archive& archive, std::size_t n, Value&& value, Guess&& guess) {
  using T = std::decay_t<decltype(value(std::size_t{0}))>;
  using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
  std::vector<Bits> more(n);
  if constexpr (!Archive::kReads)
    for (std::size_t i = 0; i < n; ++i)
      more[i] = zigzag(static_cast<Bits>(std::bit_cast<Bits>(value(i)) -
                                         std::bit_cast<Bits>(static_cast<T>(guess(i)))));
  archive.template column<Bits>(n, [&](std::size_t i) -> auto& { return more[i]; });
  if constexpr (Archive::kReads) {
    bool finite = true;
    for (std::size_t i = 0; i < n && archive.ok(); ++i) {
      const auto v = std::bit_cast<T>(
          static_cast<Bits>(std::bit_cast<Bits>(static_cast<T>(guess(i))) + unzigzag(more[i])));
      finite = finite && std::isfinite(v);
      value(i) = v;
    }
    archive.check(finite, ArchiveReader::kNotFinite);
  }
}

/// The unit [m] of which all depths are whole multiples, as images of depth have it; 0 if none of
/// the usual ones. Exact: the same numbers come back.
template <typename Depth>
[[nodiscard]] float depth_unit_m(std::size_t n, Depth&& depth_m) {
  for (const double per_metre : {5000.0, 1000.0}) {
    const auto unit_m = static_cast<float>(1.0 / per_metre);
    const auto is_multiple = [&](float m) {
      const float k = std::round(m / unit_m);
      return k >= 0 && k <= 65535 && k * unit_m == m && !std::signbit(m);
    };
    std::size_t i = 0;
    while (i < n && is_multiple(depth_m(i))) ++i;
    if (i == n) return unit_m;
  }
  return 0;
}

inline constexpr const char* kNoUnit = "depths of no unit";

/// kInOrder: neighbours resemble each other, each is kept as what it has more than the one before.
enum class Order : std::uint8_t { kInOrder, kMixed };

/// Depths in whole units, or as they are.
template <typename Archive, typename Depth>
void depths(Archive& archive, std::size_t n, Order order, Depth&& depth_m) {
  float unit_m = 0;
  if constexpr (!Archive::kReads) unit_m = depth_unit_m(n, depth_m);
  archive.number(unit_m);
  archive.check(unit_m >= 0 && unit_m < 1, kNoUnit);
  if (unit_m == 0) return archive.template column<float>(n, depth_m);
  std::vector<std::uint16_t> units(n);
  if constexpr (!Archive::kReads)
    for (std::size_t i = 0; i < n; ++i)
      units[i] = static_cast<std::uint16_t>(std::round(depth_m(i) / unit_m));
  std::uint16_t before = 0;
  const bool in_order = order == Order::kInOrder;
  if constexpr (!Archive::kReads)
    for (std::size_t i = 0; i < n && in_order; ++i) {
      const std::uint16_t here = units[i];
      units[i] = zigzag(static_cast<std::uint16_t>(here - before));
      before = here;
    }
  archive.template column<std::uint16_t>(n, [&](std::size_t i) -> auto& { return units[i]; });
  if constexpr (Archive::kReads)
    for (std::size_t i = 0; i < n; ++i) {
      if (in_order) units[i] = before = static_cast<std::uint16_t>(before + unzigzag(units[i]));
      depth_m(i) = static_cast<float>(units[i]) * unit_m;
    }
}

}  // namespace ygslam::map_fields
