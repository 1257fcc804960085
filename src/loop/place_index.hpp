// Which places of the map look like an image: a hash of landmark descriptors (multi-index hashing;
// Norouzi, Punjani, Fleet 2012). No vocabulary: empty at the start, rebuilt when a map is loaded.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_set>
#include <vector>

#include "map/map.hpp"

namespace ygslam {

struct PlaceIndexConfig {
  int max_distance = 50;     ///< Hamming: a feature may show a landmark
  int min_observations = 3;  ///< a landmark has proved static when so many keyframes saw it ...
  float min_static_weight = 0.5F;  ///< ... and it is found where it is expected
  double min_score = 6;            ///< votes that make a place worth a look
  int min_shared = 15;             ///< landmarks that make two keyframes show one place
};

/// A feature that may show a landmark.
struct PlaceHit {
  std::uint32_t feature = 0;
  LandmarkId landmark = kNoLandmark;
};

/// A keyframe whose surroundings may be what is seen.
struct PlaceCandidate {
  KeyframeId keyframe = kNoKeyframe;
  double score = 0;  ///< votes of features; one that resembles many landmarks shares its vote
};

class PlaceIndex {
 public:
  explicit PlaceIndex(const PlaceIndexConfig& config = {});

  /// Takes in the landmarks of a keyframe that have proved static since.
  void add(const Map& map, KeyframeId keyframe);
  /// Takes in all that a map has.
  void rebuild(const Map& map);

  /// @param static_weight per feature; those with 0 are not asked.
  /// @return by feature, then landmark; landmarks that left the map are left out.
  [[nodiscard]] std::vector<PlaceHit> query(const Map& map, const Features& features,
                                            std::span<const float> static_weight) const;
  /// The places that most hits agree on, best first, none of them next to another.
  /// @param excluded keyframes that are no candidates, nor are the landmarks that they see.
  [[nodiscard]] std::vector<PlaceCandidate> candidates(const Map& map,
                                                       std::span<const PlaceHit> hits,
                                                       std::span<const KeyframeId> excluded,
                                                       std::size_t max_count) const;

  [[nodiscard]] std::size_t size() const { return indexed_.size(); }

 private:
  // The tests of a descriptor stand in the order in which they were selected (features/brief.hpp):
  // the first 64 are the least correlated.
  static constexpr int kTables = 4;
  static constexpr int kKeyBits = 16;
  struct Posting {
    Descriptor descriptor;
    LandmarkId landmark = kNoLandmark;
    std::uint32_t count = 0;  ///< of the bucket, in its first posting
  };
  /// One pointer: there are many buckets, and in most maps most of them are empty.
  class Bucket {
   public:
    [[nodiscard]] std::span<const Posting> postings() const {
      return {postings_.get(), postings_ ? postings_[0].count : 0};
    }
    [[nodiscard]] const Posting* first() const { return postings_.get(); }
    void add(const Posting& posting);
    void clear() { postings_.reset(); }

   private:
    std::unique_ptr<Posting[]> postings_;  // room for the next power of two
  };
  using Table = std::vector<Bucket>;

  [[nodiscard]] static std::uint32_t key(const Descriptor& descriptor, int table) {
    return static_cast<std::uint32_t>(descriptor.bits[0] >> (kKeyBits * table)) & 0xffffU;
  }
  [[nodiscard]] bool has_proved_static(const Landmark& landmark) const;
  void insert(const Landmark& landmark);
  // The tables of a large map do not fit the processor's caches: where the buckets of a later
  // feature lie, and then what is in them, is fetched while others are compared.
  void fetch_buckets(const Descriptor& descriptor) const;
  void fetch_postings(const Descriptor& descriptor) const;

  PlaceIndexConfig config_;
  std::array<Table, kTables> tables_;
  std::unordered_set<LandmarkId> indexed_;  // no result depends on its order
};

}  // namespace ygslam
