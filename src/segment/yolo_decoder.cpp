#include "segment/yolo_decoder.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {

YoloDecoder::YoloDecoder(std::span<const float> detections, const ClassTable& classes,
                         const Prototypes& prototypes, const Letterbox& box)
    : detections_(detections),
      classes_(classes),
      cells_(detections.size() / (kYoloOtherChannels + classes.size())),
      masks_(prototypes, box) {
  CHECK(detections.size() == cells_ * (kYoloOtherChannels + classes.size()));
}

/// Row by row, as the scores lie in memory.
RowScores YoloDecoder::scores(const ClassSet& wanted) const {
  RowScores best(static_cast<int>(cells_));
  float* __restrict score = best.score.data();
  int* __restrict class_id = best.class_id.data();
  int invalid = 0;
  for (std::size_t k = 0; k < classes_.size(); ++k) {
    const int coco = classes_[k];
    if (coco == kNoCocoClass || !wanted[coco]) continue;
    const float* row = channel(kYoloBoxValues + k);
    for (std::size_t i = 0; i < cells_; ++i) {
      const float s = row[i];
      const bool valid = is_probability(s);
      invalid += valid ? 0 : 1;
      const bool better = valid && s > score[i];
      score[i] = better ? s : score[i];
      class_id[i] = better ? coco : class_id[i];
    }
  }
  best.invalid = invalid;
  return best;
}

std::optional<NetworkBox> YoloDecoder::box(int row) const {
  float v[kYoloBoxValues];
  for (std::size_t k = 0; k < kYoloBoxValues; ++k) {
    v[k] = channel(k)[row];
    if (!std::isfinite(v[k])) return std::nullopt;
  }
  return NetworkBox{{v[0] - 0.5 * v[2], v[1] - 0.5 * v[3]}, {v[0] + 0.5 * v[2], v[1] + 0.5 * v[3]}};
}

bool YoloDecoder::paint(int row, const Instance& instance, std::uint8_t id, GreyImage& ids) {
  const float* coefficients = channel(kYoloBoxValues + classes_.size()) + row;
  return masks_.paint(coefficients, cells_, instance, id, ids);
}

}  // namespace ygslam
