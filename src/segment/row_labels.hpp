// Outputs that name one class per row.
#pragma once

#include <cmath>

#include "segment/detections.hpp"

namespace ygslam {

/// Takes a row's score if its class is wanted. A row without a score is padding: its label says
/// nothing. A score that is no probability, or a label that is no class, is counted.
inline void take_labelled(int row, float score, float label, const ClassTable& classes,
                          const ClassSet& wanted, RowScores& best) {
  if (score == 0.0F) return;
  const bool is_class =
      label >= 0.0F && label < static_cast<float>(classes.size()) && label == std::floor(label);
  if (!is_probability(score) || !is_class) {
    ++best.invalid;
    return;
  }
  const int coco = classes[static_cast<std::size_t>(label)];
  if (coco == kNoCocoClass || !wanted[coco]) return;
  best.score[row] = score;
  best.class_id[row] = coco;
}

/// Corners x0, y0, x1, y1 as a network says them. @return nullopt if one is not finite.
[[nodiscard]] inline std::optional<NetworkBox> corner_box(const float* v) {
  for (int k = 0; k < 4; ++k) {
    if (!std::isfinite(v[k])) return std::nullopt;
  }
  return NetworkBox{{v[0], v[1]}, {v[2], v[3]}};
}

}  // namespace ygslam
