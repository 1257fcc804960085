#include "core/frame_clock.hpp"

#include <algorithm>

namespace ygslam {
namespace {

constexpr int kEnough = 5;                               // frames that agree
constexpr std::int64_t kUsualStep_ns = 33'333'333;       // before two frames show theirs
constexpr std::int64_t kLongestStep_ns = 1'000'000'000;  // after a pause time goes on soon

}  // namespace

std::optional<Timestamp> FrameClock::shifted(Timestamp stamp) const {
  std::int64_t ns = 0;
  if (__builtin_add_overflow(stamp.ns, shift_ns_, &ns) || ns > kLatest_ns || ns < -kLatest_ns)
    return std::nullopt;
  return Timestamp{ns};
}

FrameClock::Reading FrameClock::step(Timestamp stamp) {
  if (stamp.ns > kLatest_ns || stamp.ns < -kLatest_ns) return {};
  const auto now = shifted(stamp);
  if (now && (!last_ || *now > *last_)) {
    if (last_) step_ns_ = now->ns - last_->ns;
    last_ = now;
    refused_in_a_row_ = 0;
    believes_next_ = false;
    return {last_, false};
  }
  if (believes_next_) return go_on_from(stamp);
  const bool goes_on = refused_in_a_row_ > 0 && stamp > *refused_;
  refused_in_a_row_ = goes_on ? refused_in_a_row_ + 1 : 1;
  refused_ = stamp;
  if (refused_in_a_row_ < kEnough) return {};
  return go_on_from(stamp);
}

FrameClock::Reading FrameClock::go_on_from(Timestamp stamp) {
  const std::int64_t step_ns = step_ns_ > 0 ? std::min(step_ns_, kLongestStep_ns) : kUsualStep_ns;
  last_ = Timestamp{last_->ns + step_ns};
  shift_ns_ = last_->ns - stamp.ns;
  refused_in_a_row_ = 0;
  believes_next_ = false;
  return {last_, true};
}

}  // namespace ygslam
