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

StampOrder::Judged StreamPairing::add(Side side, StreamImage image) {
  StampOrder::Judged judged = topics_[side].order.add(std::move(image));
  put(side, judged);
  return judged;
}

/// Takes the good ones.
void StreamPairing::put(Side side, StampOrder::Judged& judged) {
  Topic& topic = topics_[side];
  if (judged.jump && judged.jump->ns <= 0) {  // what waits would wait for another time
    while (!topic.waiting.empty()) let_go(side);
    topic.newest.reset();
    const bool both_did = went_back_ && *went_back_ != side;
    went_back_ = both_did ? std::nullopt : std::optional(side);
  }
  for (StreamImage& image : judged.good) {
    if (topic.newest)
      topic.least_step_ns = std::min(topic.least_step_ns, image.stamp.ns - topic.newest->ns);
    topic.newest = image.stamp;
    bytes_ += image.bytes.size();
    topic.waiting.push_back({std::move(image), {}, false});
    settle();
    release();
    while (topic.waiting.size() > kMostImages || bytes_ > kMostBytes) forget_oldest();
  }
  judged.good.clear();
}

/// Hands on the oldest of a topic, with its partner or without.
void StreamPairing::let_go(Side side) {
  Waiting oldest = std::move(topics_[side].waiting.front());
  topics_[side].waiting.pop_front();
  if (side == kDepth && oldest.is_paired) return;  // it is with its colour image
  bytes_ -= oldest.image.bytes.size();
  if (oldest.is_paired) {
    bytes_ -= oldest.partner->bytes.size();
    outcome_.push_back({std::move(oldest.image), std::move(*oldest.partner)});
    unpaired_in_a_row_ = 0;
    return;
  }
  oldest.image.bytes = {};
  outcome_.emplace_back();
  (side == kColour ? outcome_.back().colour : outcome_.back().depth) = std::move(oldest.image);
  unpaired_ += side == kColour ? 1 : 0;
  unpaired_in_a_row_ += side == kColour ? 1 : 0;
}

void StreamPairing::forget_oldest() {
  let_go(topics_[kColour].waiting.size() >= topics_[kDepth].waiting.size() ? kColour : kDepth);
  release();
}

void StreamPairing::finish() {
  for (const Side side : {kColour, kDepth}) {
    StampOrder::Judged judged = topics_[side].order.finish();
    put(side, judged);
  }
  has_ended_ = true;
  went_back_.reset();
  settle();
  release();
}

std::optional<StreamPair> StreamPairing::take() {
  if (outcome_.empty()) return std::nullopt;
  std::optional<StreamPair> pair(std::move(outcome_.front()));
  outcome_.pop_front();
  if (pair->is_whole()) shift_behind_last(*pair);
  return pair;
}

/// Pairs are in order of time, whatever the cameras' clocks do.
void StreamPairing::shift_behind_last(StreamPair& pair) {
  constexpr std::int64_t kLongestFrame_ns = 1'000'000'000;
  const std::int64_t colour_ns = pair.colour->stamp.ns;
  const bool fits = colour_ns <= std::numeric_limits<std::int64_t>::max() - shift_ns_;
  if (last_pair_ && (!fits || colour_ns + shift_ns_ <= last_pair_->ns))
    shift_ns_ = last_pair_->ns + frame_ns_ - colour_ns;
  pair.colour->stamp.ns += shift_ns_;
  pair.depth->stamp.ns += shift_ns_;
  if (last_pair_) frame_ns_ = std::min(pair.colour->stamp.ns - last_pair_->ns, kLongestFrame_ns);
  last_pair_ = pair.colour->stamp;
}

std::int64_t StreamPairing::earliest_next_ns(Side side) const {
  const Topic& topic = topics_[side];
  if (has_ended_) return std::numeric_limits<std::int64_t>::max();
  return topic.newest ? topic.newest->ns + topic.least_step_ns
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
      went_back_.reset();
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
    if (went_back_ && *went_back_ != other) return false;  // the other clock is about to
    const std::int64_t next_ns = earliest_next_ns(other);
    if (next_ns < image.image.stamp.ns || next_ns - image.image.stamp.ns <= kMaxPairDifference_ns)
      return false;
    return std::none_of(
        topics_[other].waiting.begin(), topics_[other].waiting.end(), [&](const Waiting& w) {
          return !w.is_paired &&
                 std::llabs(w.image.stamp.ns - image.image.stamp.ns) <= kMaxPairDifference_ns;
        });
  };
  while (!depths.empty() && (depths.front().is_paired || is_hopeless(kColour, depths.front())))
    let_go(kDepth);
  while (!colours.empty() && (colours.front().is_paired || is_hopeless(kDepth, colours.front())))
    let_go(kColour);
}

}  // namespace ygslam
