#include "bag/lone_images.hpp"

#include <algorithm>
#include <utility>

namespace ygslam {

void LoneImages::Row::end() {
  if (length > 0 && length <= 2 * length_before)  // twice in succession: it is the usual
    too_long = std::clamp(2 * length, too_long, kLongest);
  length_before = std::exchange(length, 0);
  waiting.clear();
}

std::optional<LoneImages::Frame> LoneImages::judge(StreamPair pair, Fault fault) {
  if (pair.is_whole()) {
    has_begun_ = true;
    for (Row& row : rows_) row.end();
    return Frame{std::move(pair)};
  }
  add({std::move(pair), fault});
  return take();
}

void LoneImages::add(Frame frame) {
  if (!has_begun_) return;
  const bool is_colour = frame.pair.colour.has_value();
  if (is_colour) rows_[StreamPairing::kDepth].end();  // then colour tells of the time
  Row& row = rows_[is_colour ? StreamPairing::kColour : StreamPairing::kDepth];
  row.waiting.push_back(std::move(frame));
  if (++row.length < row.too_long) return;
  due_.insert(due_.end(), std::make_move_iterator(row.waiting.begin()),
              std::make_move_iterator(row.waiting.end()));
  row.waiting.clear();
}

std::optional<LoneImages::Frame> LoneImages::take() {
  if (due_.empty()) return std::nullopt;
  std::optional<Frame> frame(std::move(due_.front()));
  due_.pop_front();
  return frame;
}

}  // namespace ygslam
