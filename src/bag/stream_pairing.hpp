// Which colour image belongs to which depth image, while they come.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "bag/stamp_order.hpp"
#include "core/time.hpp"

namespace ygslam {

/// Two images that belong together, or one that has no partner (without bytes).
struct StreamPair {
  std::optional<StreamImage> colour, depth;
  [[nodiscard]] bool is_whole() const { return colour && depth; }
};

/// The pairs of pair_one_to_one(), each as soon as nothing that may still come can change it. What
/// it takes for granted: of a topic the next image comes at least as long after the last as any two
/// before, 10 ms at most. Where both clocks go back for good, pairs go on one frame after the last.
class StreamPairing {
 public:
  enum Side { kColour, kDepth };

  explicit StreamPairing(StampOrder::First first = StampOrder::First::kMustAgree)
      : topics_{Topic{StampOrder(first)}, Topic{StampOrder(first)}} {}

  /// @return what its stamp tells (StampOrder), without the good ones.
  StampOrder::Judged add(Side side, StreamImage image);
  /// No more images come.
  void finish();
  /// What comes next: pairs in order of time, among them images that have got no partner.
  /// @return nullopt if there is nothing yet.
  std::optional<StreamPair> take();

  /// The last stamp of a topic that was believed.
  [[nodiscard]] std::optional<Timestamp> last(Side side) const {
    return topics_[side].order.last();
  }
  /// Colour images that have got no partner, those with wrong stamps left aside.
  [[nodiscard]] std::size_t unpaired() const { return unpaired_; }
  /// Those since the last pair.
  [[nodiscard]] std::size_t unpaired_in_a_row() const { return unpaired_in_a_row_; }
  /// What is added to the stamps of pairs, since clocks went back.
  [[nodiscard]] std::int64_t shift_ns() const { return shift_ns_; }

 private:
  // What waits, so that a topic that dries up costs neither memory nor time without end.
  static constexpr std::size_t kMostImages = 64;  // of a topic: two seconds
  static constexpr std::size_t kMostBytes = std::size_t{256} << 20;

  struct Waiting {
    StreamImage image;
    std::optional<StreamImage> partner;  ///< of a colour image
    bool is_paired = false;
  };
  struct Topic {
    StampOrder order;
    std::deque<Waiting> waiting{};      ///< in order of time
    std::optional<Timestamp> newest{};  ///< that was ever there to be paired
    std::int64_t least_step_ns = 10'000'000;
  };
  [[nodiscard]] std::int64_t earliest_next_ns(Side side) const;
  void put(Side side, StampOrder::Judged& judged);
  void settle();
  void release();
  void let_go(Side side);
  void forget_oldest();
  void shift_behind_last(StreamPair& pair);

  std::array<Topic, 2> topics_;
  std::deque<StreamPair> outcome_;
  std::size_t bytes_ = 0;  // of those that wait
  std::size_t unpaired_ = 0, unpaired_in_a_row_ = 0;
  std::optional<Side> went_back_;       // alone, so far
  std::optional<Timestamp> last_pair_;  // as handed out
  std::int64_t frame_ns_ = 33'333'333;  // between the last two
  std::int64_t shift_ns_ = 0;
  bool has_ended_ = false;
};

}  // namespace ygslam
