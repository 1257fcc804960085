// Which stamps of a topic can be believed, while its images come.
#pragma once

#include <cmath>
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

/// A step forward of more than this is looked at twice, here as in a list.
inline constexpr std::int64_t kStampJump_ns = 10'000'000'000;
/// Stamps may be anything: their difference fits into no integer.
[[nodiscard]] inline double apart_s(Timestamp a, Timestamp b) {
  return 1e-9 * std::abs(static_cast<double>(a.ns) - static_cast<double>(b.ns));
}
[[nodiscard]] inline bool are_far_apart(Timestamp a, Timestamp b) {
  return apart_s(a, b) > 1e-9 * static_cast<double>(kStampJump_ns);
}

/// Sorts a topic's images into those that go on in time and those whose stamps are wrong. What goes
/// back, or far ahead, is believed once several images agree: then the clock was set, or the camera
/// started anew. Until then these wait, as the very first do; at the usual rates for 0.2 s at most.
class StampOrder {
 public:
  enum class First {
    kMustAgree,   ///< the very first images wait like others that are elsewhere
    kIsBelieved,  ///< for who cannot wait: a wrong one is found out by those that follow
  };
  explicit StampOrder(First first = First::kMustAgree) : first_(first) {}

  struct Jump {
    std::int64_t ns;     ///< from the last good stamp before to the next
    std::size_t number;  ///< of that image
  };
  struct Judged {
    std::vector<StreamImage> good;  ///< their stamps increase
    std::vector<StreamImage> bad;   ///< before them; without bytes
    std::optional<Jump> jump;       ///< `good` begins elsewhere
  };

  [[nodiscard]] Judged add(StreamImage image);
  /// No more images come.
  [[nodiscard]] Judged finish();

  /// The last good one.
  [[nodiscard]] std::optional<Timestamp> last() const { return last_; }
  /// Bytes of the images that wait.
  [[nodiscard]] std::size_t waiting_bytes() const { return waiting_bytes_; }

 private:
  [[nodiscard]] std::size_t increasing_tail(std::int64_t longest_step_ns) const;
  [[nodiscard]] std::size_t agreeing();
  void reject(std::size_t count, Judged& judged);
  void accept(std::size_t count, Judged& judged);

  First first_;
  std::deque<StreamImage> waiting_;  // in the order in which they came
  std::size_t waiting_bytes_ = 0;
  std::optional<Timestamp> last_;
  std::int64_t longest_step_ns_ = kStampJump_ns;  // of slow cameras more
};

}  // namespace ygslam
