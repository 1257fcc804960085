// Which things a tracker of objects should show in a frame, from the frame's exact or recorded
// masks.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/time.hpp"
#include "eval/dynamic_score.hpp"
#include "eval/tracking_score.hpp"

namespace ygslam {

/// Fewer visible pixels need not be found (COCO's limit of a small object).
inline constexpr std::size_t kLeastVisible_px = 32 * 32;
/// A thing of no movable class counts while it moves and for so long after [s], unless it touches
/// one that is (what a person carries or pushes may be taken for a part of the person).
inline constexpr double kMovedLately_s = 1;

class TruthBoxes {
 public:
  /// @param movable per id of the masks: of a movable class, counts also at rest.
  explicit TruthBoxes(const std::array<bool, 256>& movable) : movable_(movable) {}

  /// Boxes of the visible pixels of one frame's ids, in order of the ids.
  [[nodiscard]] std::vector<IdBox> step(Timestamp stamp, const DynamicTruth& truth);

 private:
  struct Visible {
    PixelBox box;
    std::size_t pixels = 0, moving = 0;
  };
  [[nodiscard]] bool is_held(std::size_t id, const std::array<Visible, 256>& things) const;

  std::array<bool, 256> movable_;
  std::array<std::optional<Timestamp>, 256> moved_;  // last time per id
};

}  // namespace ygslam
