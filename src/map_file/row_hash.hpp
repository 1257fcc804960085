// A row's name and the 64-bit hash of what it holds: by it a writer knows what has changed, and a
// file that all its rows belong together.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <span>

namespace ygslam::map_file {

/// Tables whose rows are numbered; `meta` stands apart.
enum class Table : std::uint8_t {
  kKeyframe,      ///< parent and time
  kPose,          ///< T_camera_world: apart, for corrections rewrite it
  kSeen,          ///< features, free-space image, read-out: never rewritten
  kWeight,        ///< of the features
  kLandmarks,     ///< in chunks of kChunk numbers
  kObservations,  ///< of the landmarks of the same chunk
  kRemoved,       ///< removed keyframes, in chunks
};
inline constexpr std::array<const char*, 7> kTableNames = {
    "keyframe", "pose", "seen", "weight", "landmarks", "observations", "removed"};
inline constexpr std::size_t kTables = kTableNames.size();
inline constexpr std::uint32_t kChunk = 1024;

[[nodiscard]] inline const char* name_of(Table table) {
  return kTableNames[static_cast<std::size_t>(table)];
}

struct RowKey {
  Table table{};
  std::uint32_t id = 0;
};

/// A bijection that spreads every bit over the word (the finaliser of MurmurHash3, public domain).
[[nodiscard]] inline std::uint64_t spread(std::uint64_t h) {
  h = (h ^ (h >> 33)) * 0xff51afd7ed558ccdULL;
  h = (h ^ (h >> 33)) * 0xc4ceb9fe1a85ec53ULL;
  return h ^ (h >> 33);
}

[[nodiscard]] inline std::uint64_t hash_of(std::span<const char> bytes) {
  std::uint64_t h = 0x9e3779b97f4a7c15ULL ^ bytes.size();
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, 8);
    h = (h ^ word) * 0xff51afd7ed558ccdULL;
    h ^= h >> 32;
  }
  std::uint64_t rest = 0;
  if (i < bytes.size()) std::memcpy(&rest, bytes.data() + i, bytes.size() - i);
  return spread(h ^ rest);
}

/// A row's share of the file's digest, which is the sum of all shares: rows may come and go in any
/// order without all others being read again.
[[nodiscard]] inline std::uint64_t share_of(const RowKey& key, std::uint64_t hash) {
  return spread(hash ^
                spread((std::uint64_t{key.id} << 8) + static_cast<std::uint64_t>(key.table) + 1));
}

}  // namespace ygslam::map_file
