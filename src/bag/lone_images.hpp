// Images of a stream that have no partner: a few cost nothing, many are time without a frame.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>

#include "bag/stream_pairing.hpp"

namespace ygslam {

/// Lets pairs pass, and of a row of images without a partner that is longer than usual each as a
/// frame that nobody can use. Before the first pair there is no such row: cameras begin one by one.
class LoneImages {
 public:
  enum class Fault { kPartner, kStamp };
  struct Frame {
    StreamPair pair;
    Fault fault = Fault::kPartner;  ///< where it is not whole
  };

  /// @return what it is as a frame, if it is one.
  std::optional<Frame> judge(StreamPair pair, Fault fault);
  /// The same for take().
  void add(Frame frame);
  /// Frames of a row that has become long. @return nullopt if there is none.
  std::optional<Frame> take();
  /// There was a pair.
  [[nodiscard]] bool has_begun() const { return has_begun_; }

 private:
  // At 30 Hz a second. Where depth is always slower than colour, or the other way round, twice as
  // many as are in every row; but not without end.
  static constexpr std::size_t kLong = 30, kLongest = 300;
  struct Row {
    std::deque<Frame> waiting;
    std::size_t length = 0, length_before = 0;
    std::size_t too_long = kLong;
    void end();
  };
  std::array<Row, 2> rows_;  // of colour, of depth
  std::deque<Frame> due_;
  bool has_begun_ = false;
};

}  // namespace ygslam
