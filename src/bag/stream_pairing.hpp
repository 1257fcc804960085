// Which colour image belongs to which depth image, while they come.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "bag/cdr.hpp"
#include "core/time.hpp"

namespace ygslam {

/// An image as it came.
struct StreamImage {
  Timestamp stamp;
  std::size_t number = 0;  ///< of its topic: 0, 1, ...
  Bytes bytes;
};

struct StreamPair {
  StreamImage colour, depth;
};

/// The pairs of pair_one_to_one(), each as soon as nothing that may still come can change it. What
/// it takes for granted: of a topic the next image comes at least as long after the last as any two
/// before, 10 ms at most.
class StreamPairing {
 public:
  enum Side { kColour, kDepth };

  /// @return false where it is left out: not after the one before it, or its stamp is negative or
  /// later than 146 years.
  bool add(Side side, StreamImage image);
  /// No more images come.
  void finish();
  /// The next pair in order of time. @return nullopt if there is none yet.
  std::optional<StreamPair> take();

  /// Colour images that have got no partner.
  [[nodiscard]] std::size_t unpaired() const { return unpaired_; }
  /// Those since the last pair.
  [[nodiscard]] std::size_t unpaired_in_a_row() const { return unpaired_in_a_row_; }

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
    std::deque<Waiting> waiting;  ///< in order of time
    std::optional<Timestamp> last;
    std::int64_t least_step_ns = 10'000'000;
  };
  [[nodiscard]] std::int64_t earliest_next_ns(Side side) const;
  void settle();
  void release();
  void forget_oldest();

  std::array<Topic, 2> topics_;
  std::deque<StreamPair> pairs_;
  std::size_t bytes_ = 0;  // of those that wait
  std::size_t unpaired_ = 0, unpaired_in_a_row_ = 0;
  bool has_ended_ = false;
};

}  // namespace ygslam
