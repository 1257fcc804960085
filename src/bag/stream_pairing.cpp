#include "bag/stream_pairing.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "io/pairing.hpp"

namespace ygslam {
namespace {

/// Two that may belong together; the order is that of pair_one_to_one(): nearest first, then
/// earliest.
struct Candidate {
  std::int64_t difference_ns, earlier_ns;
  std::size_t colour, depth;  // places among those that wait
  auto operator<=>(const Candidate&) const = default;
};

}  // namespace

bool StreamPairing::add(Side side, StreamImage image) {
  Topic& topic = topics_[side];
  constexpr std::int64_t kLatest_ns = std::numeric_limits<std::int64_t>::max() / 2;
  if (image.stamp.ns < 0 || image.stamp.ns > kLatest_ns) return false;
  if (topic.last && image.stamp <= *topic.last) return false;
  if (topic.last)
    topic.least_step_ns = std::min(topic.least_step_ns, image.stamp.ns - topic.last->ns);
  topic.last = image.stamp;
  bytes_ += image.bytes.size();
  topic.waiting.push_back({std::move(image), {}, false});
  settle();
  release();
  while (topic.waiting.size() > kMostImages || bytes_ > kMostBytes) forget_oldest();
  return true;
}

void StreamPairing::forget_oldest() {
  const Side side =
      topics_[kColour].waiting.size() >= topics_[kDepth].waiting.size() ? kColour : kDepth;
  auto& waiting = topics_[side].waiting;
  bytes_ -= waiting.front().image.bytes.size();
  waiting.pop_front();
  unpaired_ += side == kColour ? 1 : 0;
  unpaired_in_a_row_ += side == kColour ? 1 : 0;
  release();
}

void StreamPairing::finish() {
  has_ended_ = true;
  settle();
  release();
}

std::optional<StreamPair> StreamPairing::take() {
  if (pairs_.empty()) return std::nullopt;
  std::optional<StreamPair> pair(std::move(pairs_.front()));
  pairs_.pop_front();
  return pair;
}

std::int64_t StreamPairing::earliest_next_ns(Side side) const {
  const Topic& topic = topics_[side];
  if (has_ended_) return std::numeric_limits<std::int64_t>::max();
  return topic.last ? topic.last->ns + topic.least_step_ns
                    : std::numeric_limits<std::int64_t>::min();
}

/// Two are a pair once no other candidate of either comes before them, be it here or still to come.
void StreamPairing::settle() {
  auto& colours = topics_[kColour].waiting;
  auto& depths = topics_[kDepth].waiting;
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    for (std::size_t j = 0; j < depths.size(); ++j) {
      if (colours[i].is_paired || depths[j].is_paired) continue;
      const std::int64_t c = colours[i].image.stamp.ns;
      const std::int64_t d = depths[j].image.stamp.ns;
      if (std::llabs(c - d) <= kMaxPairDifference_ns)
        candidates.push_back({std::llabs(c - d), std::min(c, d), i, j});
    }
  }
  std::sort(candidates.begin(), candidates.end());
  enum State : char { kFree, kUndecided, kTaken };
  std::vector<State> colour_is(colours.size(), kFree);
  std::vector<State> depth_is(depths.size(), kFree);
  for (const Candidate& candidate : candidates) {
    State& colour_state = colour_is[candidate.colour];
    State& depth_state = depth_is[candidate.depth];
    if (colour_state == kTaken || depth_state == kTaken) continue;
    Waiting& colour = colours[candidate.colour];
    Waiting& depth = depths[candidate.depth];
    const auto is_safe = [&](Side side, const Waiting& partner) {
      const std::int64_t next_ns = earliest_next_ns(side);
      return next_ns >= partner.image.stamp.ns &&
             next_ns - partner.image.stamp.ns >= candidate.difference_ns;
    };
    const bool is_first = colour_state == kFree && depth_state == kFree;
    if (is_first && is_safe(kColour, depth) && is_safe(kDepth, colour)) {
      colour.partner = std::move(depth.image);
      colour.is_paired = depth.is_paired = true;
      colour_state = depth_state = kTaken;
    } else {
      colour_state = depth_state =
          kUndecided;  // those after it have to wait for what becomes of it
    }
  }
}

/// Hands on pairs in order of time, forgets what can have no partner any more.
void StreamPairing::release() {
  auto& colours = topics_[kColour].waiting;
  auto& depths = topics_[kDepth].waiting;
  const auto is_hopeless = [&](Side other, const Waiting& image) {
    const std::int64_t next_ns = earliest_next_ns(other);
    if (next_ns < image.image.stamp.ns || next_ns - image.image.stamp.ns <= kMaxPairDifference_ns)
      return false;
    return std::none_of(
        topics_[other].waiting.begin(), topics_[other].waiting.end(), [&](const Waiting& w) {
          return !w.is_paired &&
                 std::llabs(w.image.stamp.ns - image.image.stamp.ns) <= kMaxPairDifference_ns;
        });
  };
  while (!depths.empty() && (depths.front().is_paired || is_hopeless(kColour, depths.front()))) {
    if (!depths.front().is_paired) bytes_ -= depths.front().image.bytes.size();
    depths.pop_front();
  }
  while (!colours.empty() && (colours.front().is_paired || is_hopeless(kDepth, colours.front()))) {
    Waiting& colour = colours.front();
    bytes_ -= colour.image.bytes.size();
    if (colour.is_paired) {
      bytes_ -= colour.partner->bytes.size();
      pairs_.push_back({std::move(colour.image), std::move(*colour.partner)});
      unpaired_in_a_row_ = 0;
    } else {
      ++unpaired_;
      ++unpaired_in_a_row_;
    }
    colours.pop_front();
  }
}

}  // namespace ygslam
