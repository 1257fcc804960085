// The stamps of a caller's frames, whose clock may be set while the robot drives.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "core/time.hpp"

namespace ygslam {

/// Stamps that go back are wrong, until several in a row agree: then the clock was set back, and
/// time goes on from the stamps before (as in streams and bags, see bag/stamp_order.hpp).
class FrameClock {
 public:
  /// Stamps beyond are refused: differences of any two that are not fit 64 bits.
  static constexpr std::int64_t kLatest_ns = std::numeric_limits<std::int64_t>::max() / 2;

  /// What a frame's stamp is worth.
  struct Reading {
    std::optional<Timestamp> stamp;  ///< later than those before; nullopt: to be refused
    bool was_set_back = false;       ///< believed from this frame on
  };
  [[nodiscard]] Reading step(Timestamp stamp);

  /// What comes next is believed whatever it says.
  void restart() { believes_next_ = true; }
  /// Added to stamps since the clock was set back.
  [[nodiscard]] std::int64_t shift_ns() const { return shift_ns_; }

 private:
  [[nodiscard]] std::optional<Timestamp> shifted(Timestamp stamp) const;
  Reading go_on_from(Timestamp stamp);

  std::optional<Timestamp> last_;  // shifted
  std::int64_t step_ns_ = 0;       // between the last two
  std::int64_t shift_ns_ = 0;
  std::optional<Timestamp> refused_;  // the last one, as it came
  int refused_in_a_row_ = 0;
  bool believes_next_ = false;
};

}  // namespace ygslam
