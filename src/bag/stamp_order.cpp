#include "bag/stamp_order.hpp"

#include <algorithm>
#include <limits>

namespace ygslam {
namespace {

// Images that agree: as many, or fewer of a slow camera, or of enormous ones.
constexpr std::size_t kEnough = 5;
constexpr std::size_t kEnoughSlow = 3;
constexpr std::int64_t kSlow_ns = 1'000'000'000;  // that these last
// As many wait for others; all of them increasing agree, too, however slow.
constexpr std::size_t kMostWaiting = 10;
constexpr std::size_t kMostWaitingBytes = std::size_t{128} << 20;
constexpr std::int64_t kAnyStep_ns = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kLatest_ns = std::numeric_limits<std::int64_t>::max() / 2;

}  // namespace

StampOrder::Judged StampOrder::add(StreamImage image) {
  Judged judged;
  const Timestamp stamp = image.stamp;
  if (stamp.ns < 0 || stamp.ns > kLatest_ns) {
    image.bytes = {};
    judged.bad.push_back(std::move(image));
    return judged;
  }
  const bool goes_on = last_ && stamp > *last_ && stamp.ns - last_->ns <= longest_step_ns_;
  if (goes_on || (!last_ && first_ == First::kIsBelieved)) {
    reject(waiting_.size(), judged);
    last_ = stamp;
    judged.good.push_back(std::move(image));
    return judged;
  }
  waiting_bytes_ += image.bytes.size();
  waiting_.push_back(std::move(image));
  if (const std::size_t count = agreeing(); count > 0) accept(count, judged);
  while (waiting_.size() >= kMostWaiting ||
         (waiting_.size() > 1 && waiting_bytes_ > kMostWaitingBytes))
    reject(1, judged);
  return judged;
}

StampOrder::Judged StampOrder::finish() {
  Judged judged;
  const std::size_t count = increasing_tail(longest_step_ns_);
  if (count == 0) return judged;
  // One alone may be the first after a pause, but none that goes back.
  if (!last_ || waiting_[waiting_.size() - count].stamp > *last_)
    accept(count, judged);
  else
    reject(waiting_.size(), judged);
  return judged;
}

/// How many of those that came last increase by steps of at most this.
std::size_t StampOrder::increasing_tail(std::int64_t longest_step_ns) const {
  if (waiting_.empty()) return 0;
  std::size_t count = 1;
  for (std::size_t i = waiting_.size() - 1; i > 0; --i, ++count) {
    const std::int64_t step_ns = waiting_[i].stamp.ns - waiting_[i - 1].stamp.ns;
    if (step_ns <= 0 || step_ns > longest_step_ns) break;
  }
  return count;
}

/// How many of those that came last agree; 0: too few.
std::size_t StampOrder::agreeing() {
  const std::size_t count = increasing_tail(longest_step_ns_);
  const std::int64_t lasts_ns =
      waiting_.back().stamp.ns - waiting_[waiting_.size() - count].stamp.ns;
  if (count >= kEnough || (count >= kEnoughSlow && lasts_ns >= kSlow_ns)) return count;
  if (count > 1 && waiting_bytes_ > kMostWaitingBytes) return count;
  if (increasing_tail(kAnyStep_ns) < kMostWaiting) return 0;
  for (std::size_t i = 1; i < waiting_.size(); ++i)
    longest_step_ns_ =
        std::max(longest_step_ns_,
                 2 * std::min(waiting_[i].stamp.ns - waiting_[i - 1].stamp.ns, kLatest_ns));
  return waiting_.size();
}

void StampOrder::reject(std::size_t count, Judged& judged) {
  for (; count > 0; --count) {
    StreamImage& image = waiting_.front();
    waiting_bytes_ -= image.bytes.size();
    image.bytes = {};
    judged.bad.push_back(std::move(image));
    waiting_.pop_front();
  }
}

/// Those that came last and agree; of a topic's very first images all that go on to them.
void StampOrder::accept(std::size_t count, Judged& judged) {
  if (last_) reject(waiting_.size() - count, judged);
  const StreamImage& begin = waiting_[waiting_.size() - count];
  if (last_) judged.jump = {begin.stamp.ns - last_->ns, begin.number};
  Timestamp first = begin.stamp;
  for (; !waiting_.empty(); waiting_.pop_back()) {
    StreamImage& image = waiting_.back();
    const bool goes_on_to_them =
        image.stamp < first && first.ns - image.stamp.ns <= longest_step_ns_;
    const bool is_good = judged.good.size() < count || goes_on_to_them;
    if (is_good) first = image.stamp;
    if (!is_good) image.bytes = {};
    (is_good ? judged.good : judged.bad).push_back(std::move(image));
  }
  std::ranges::reverse(judged.good);
  last_ = judged.good.back().stamp;
  waiting_bytes_ = 0;
}

}  // namespace ygslam
