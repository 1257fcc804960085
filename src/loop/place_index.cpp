#include "loop/place_index.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>
#include <utility>

namespace ygslam {
namespace {

constexpr std::size_t kLeastStale = 1000;  // postings of landmarks that left are not worth a sweep
constexpr std::uint32_t kAhead = 4;        // features whose buckets are on their way to the cache

}  // namespace

PlaceIndex::PlaceIndex(const PlaceIndexConfig& config) : config_(config) {
  for (Table& table : tables_) table.resize(std::size_t{1} << kKeyBits);
}

void PlaceIndex::Bucket::add(const Posting& posting) {
  const auto before = static_cast<std::uint32_t>(postings().size());
  if (before == 0 || std::has_single_bit(before)) {
    auto larger = std::make_unique<Posting[]>(std::max(1U, 2 * before));
    std::copy_n(postings_.get(), before, larger.get());
    postings_ = std::move(larger);
  }
  postings_[before] = posting;
  postings_[0].count = before + 1;
}

bool PlaceIndex::has_proved_static(const Landmark& landmark) const {
  return static_cast<int>(landmark.observations.size()) >= config_.min_observations &&
         landmark.static_weight() >= config_.min_static_weight;
}

void PlaceIndex::insert(const Landmark& landmark) {
  if (!has_proved_static(landmark) || !indexed_.insert(landmark.id).second) return;
  for (int t = 0; t < kTables; ++t)
    tables_[t][key(landmark.descriptor, t)].add({landmark.descriptor, landmark.id});
}

void PlaceIndex::add(const Map& map, KeyframeId keyframe) {
  if (indexed_.size() > 2 * map.landmark_count() + kLeastStale) rebuild(map);
  for (const LandmarkId id : map.keyframe(keyframe).landmarks)
    if (id != kNoLandmark) insert(map.landmark(id));
}

void PlaceIndex::rebuild(const Map& map) {
  indexed_.clear();
  for (Table& table : tables_)
    for (auto& bucket : table) bucket.clear();
  for (const auto& [id, keyframe] : map.keyframes())
    for (const LandmarkId landmark : keyframe.landmarks)
      if (landmark != kNoLandmark) insert(map.landmark(landmark));
}

void PlaceIndex::fetch_buckets(const Descriptor& descriptor) const {
  for (int t = 0; t < kTables; ++t) __builtin_prefetch(&tables_[t][key(descriptor, t)]);
}

void PlaceIndex::fetch_postings(const Descriptor& descriptor) const {
  for (int t = 0; t < kTables; ++t) {
    const Posting* first = tables_[t][key(descriptor, t)].first();
    if (first == nullptr) continue;
    // How many there are stands in the first: of those behind it the next may be fetched at most.
    __builtin_prefetch(first);
    __builtin_prefetch(first + 1);
  }
}

std::vector<PlaceHit> PlaceIndex::query(const Map& map, const Features& features,
                                        std::span<const float> static_weight) const {
  std::vector<PlaceHit> hits;
  for (std::uint32_t i = 0; i < features.size(); ++i) {
    if (i + 2 * kAhead < features.size()) fetch_buckets(features.descriptors[i + 2 * kAhead]);
    if (i + kAhead < features.size()) fetch_postings(features.descriptors[i + kAhead]);
    if (static_weight[i] <= 0) continue;
    const auto first = static_cast<std::ptrdiff_t>(hits.size());
    const Descriptor& descriptor = features.descriptors[i];
    for (int t = 0; t < kTables; ++t) {
      for (const Posting& posting : tables_[t][key(descriptor, t)].postings()) {
        if (distance(descriptor, posting.descriptor) <= config_.max_distance)
          hits.push_back({i, posting.landmark});
      }
    }
    // A landmark may lie in the feature's bucket of several tables.
    std::sort(hits.begin() + first, hits.end(),
              [](const PlaceHit& a, const PlaceHit& b) { return a.landmark < b.landmark; });
    const auto same = [&](const PlaceHit& a, const PlaceHit& b) {
      return a.landmark == b.landmark;
    };
    hits.erase(std::unique(hits.begin() + first, hits.end(), same), hits.end());
  }
  std::erase_if(hits, [&](const PlaceHit& hit) { return !map.has_landmark(hit.landmark); });
  return hits;
}

std::vector<PlaceCandidate> PlaceIndex::candidates(const Map& map, std::span<const PlaceHit> hits,
                                                   std::span<const KeyframeId> excluded,
                                                   std::size_t max_count) const {
  const std::set<KeyframeId> near(excluded.begin(), excluded.end());
  std::map<KeyframeId, double> score;
  for (std::size_t begin = 0; begin < hits.size();) {
    std::size_t end = begin + 1;
    while (end < hits.size() && hits[end].feature == hits[begin].feature) ++end;
    // A texture that repeats (tiles, keyboards) says little about the place (burstiness; Jegou,
    // Douze, Schmid 2009).
    const double vote = 1 / std::sqrt(static_cast<double>(end - begin));
    std::set<KeyframeId> voted;
    for (std::size_t i = begin; i < end; ++i) {
      const auto& observations = map.landmark(hits[i].landmark).observations;
      const bool is_near =
          std::any_of(observations.begin(), observations.end(),
                      [&](const LandmarkObservation& o) { return near.contains(o.keyframe); });
      if (is_near) continue;
      for (const LandmarkObservation& o : observations)
        if (voted.insert(o.keyframe).second) score[o.keyframe] += vote;
    }
    begin = end;
  }
  std::vector<PlaceCandidate> ranked;
  for (const auto& [id, votes] : score)
    if (votes >= config_.min_score) ranked.push_back({id, votes});
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const PlaceCandidate& a, const auto& b) { return a.score > b.score; });
  std::vector<PlaceCandidate> places;
  for (const PlaceCandidate& candidate : ranked) {
    if (places.size() >= max_count) break;
    const auto& covisible = map.keyframe(candidate.keyframe).covisible;
    const auto is_neighbour = [&](const PlaceCandidate& place) {
      const auto it = covisible.find(place.keyframe);
      return it != covisible.end() && it->second >= config_.min_shared;
    };
    if (std::none_of(places.begin(), places.end(), is_neighbour)) places.push_back(candidate);
  }
  return places;
}

}  // namespace ygslam
