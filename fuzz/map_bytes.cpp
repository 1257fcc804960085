#include "map/map_bytes.hpp"

#include <zlib.h>

#include "core/check.hpp"
#include "fuzz/targets.hpp"

namespace ygslam::fuzz {
namespace {

constexpr std::array<double, 4> kBounds_px = {-0.5, -0.5, 63.5, 47.5};
constexpr std::size_t kMark_bytes = 8;  // magic and schema; then the checksum of the rest

/// What is accepted holds together: it can be written, and read as the same.
void check(const Result<Map>& map) {
  if (!map.ok()) return;
  const std::string bytes = to_bytes(*map);
  const auto again = map_from_bytes(bytes, kBounds_px);
  CHECK(again.ok(), again.ok() ? "" : again.error().message.c_str());
  CHECK(to_bytes(*again) == bytes);
  for (const auto& [id, keyframe] : map->keyframes())
    for (const auto& [other, shared] : keyframe.covisible)
      CHECK(shared > 0 && map->keyframe(other).covisible.at(id) == shared);
  for (const RemovedKeyframe& removed : map->removed_keyframes())
    CHECK(map->resolved_pose(removed.id).t().allFinite());
}

}  // namespace

void map_bytes(std::string_view bytes) {
  check(map_from_bytes(bytes, kBounds_px));
  // The same as a map's body, signed.
  std::string whole = to_bytes(Map({1, 1.2})).substr(0, kMark_bytes);
  const auto checksum = static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
  whole.append(reinterpret_cast<const char*>(&checksum), sizeof(checksum));
  check(map_from_bytes(whole += bytes, kBounds_px));
}

}  // namespace ygslam::fuzz
