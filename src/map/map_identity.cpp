#include "map/map_identity.hpp"

#include <bit>
#include <charconv>
#include <random>

#include <fmt/format.h>

#include "core/content_hash.hpp"

namespace ygslam {
namespace {

constexpr std::uint64_t kVersion4 = 4, kVersion8 = 8;  // random; of content, in a way of our own

MapIdentity as_uuid(std::uint64_t high, std::uint64_t low, std::uint64_t version) {
  return {(high & ~0xf000ULL) | version << 12, (low & ~(3ULL << 62)) | 2ULL << 62};
}

std::uint64_t bits_of(float x, float y) {
  return std::uint64_t{std::bit_cast<std::uint32_t>(x)} << 32 | std::bit_cast<std::uint32_t>(y);
}

/// @param half another number for each half of an identity.
std::uint64_t content_of(const KeyframeData& keyframe, std::uint64_t half) {
  ContentHash hash;
  hash.add(half);
  hash.add(static_cast<std::uint64_t>(keyframe.stamp.ns));
  hash.add(sight_of(keyframe));
  for (const Feature& feature : keyframe.features->points) {
    hash.add(bits_of(feature.uv_px.x(), feature.uv_px.y()));
    hash.add(bits_of(feature.depth_m, 0));
  }
  hash.add(half);
  return hash.value();
}

}  // namespace

MapIdentity random_identity() {
  std::random_device device;
  const auto word = [&] { return (std::uint64_t{device()} << 32) | device(); };
  const std::uint64_t high = word();
  return as_uuid(high, word(), kVersion4);
}

MapIdentity identity_of(const KeyframeData& first) {
  return as_uuid(content_of(first, 1), content_of(first, 2), kVersion8);
}

std::string to_string(const MapIdentity& identity) {
  const auto [high, low] = identity;
  return fmt::format("{:08x}-{:04x}-{:04x}-{:04x}-{:012x}", high >> 32, (high >> 16) & 0xffff,
                     high & 0xffff, low >> 48, low & 0xffffffffffffULL);
}

std::optional<MapIdentity> parse_identity(std::string_view text) {
  constexpr std::size_t kDigits = 16;  // of a half
  std::string digits;
  for (const char c : text)
    if (c != '-') digits += c;
  if (digits.size() != 2 * kDigits) return std::nullopt;
  MapIdentity identity;
  const char* const begin = digits.data();
  std::from_chars(begin, begin + kDigits, identity.high, 16);
  std::from_chars(begin + kDigits, begin + 2 * kDigits, identity.low, 16);
  if (to_string(identity) != text) return std::nullopt;
  return identity;
}

std::uint64_t sight_of(const KeyframeData& keyframe) {
  ContentHash hash;
  for (const Descriptor& descriptor : keyframe.features->descriptors) hash.add_all(descriptor.bits);
  return hash.value();
}

}  // namespace ygslam
