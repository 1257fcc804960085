#include "segment/rfdetr_decoder.hpp"

#include <cmath>

namespace ygslam {

RfdetrDecoder::RfdetrDecoder(const RfdetrOutputs& outputs, const ClassTable& classes,
                             const Letterbox& box)
    : outputs_(outputs),
      classes_(classes),
      net_width_(box.net_width),
      net_height_(box.net_height),
      sampler_(box, outputs.mask_width, outputs.mask_height) {
  const std::size_t queries = outputs.boxes.size() / kRfdetrBoxValues;
  CHECK(outputs.boxes.size() == queries * kRfdetrBoxValues);
  CHECK(outputs.logits.size() == queries * classes.size());
  CHECK(outputs.masks.size() ==
        queries * static_cast<std::size_t>(outputs.mask_width) * outputs.mask_height);
}

RowScores RfdetrDecoder::scores(const ClassSet& wanted) const {
  RowScores best(static_cast<int>(outputs_.boxes.size() / kRfdetrBoxValues));
  for (int row = 0; row < std::ssize(best.score); ++row) {
    const float* logits = outputs_.logits.data() + row * classes_.size();
    for (std::size_t k = 0; k < classes_.size(); ++k) {
      const int coco = classes_[k];
      if (coco == kNoCocoClass || !wanted[coco]) continue;
      if (std::isnan(logits[k])) {
        ++best.invalid;
        continue;
      }
      const float score = 1.0F / (1.0F + std::exp(-logits[k]));
      if (score <= best.score[row]) continue;
      best.score[row] = score;
      best.class_id[row] = coco;
    }
  }
  return best;
}

std::optional<NetworkBox> RfdetrDecoder::box(int row) const {
  const float* v = outputs_.boxes.data() + static_cast<std::size_t>(row) * kRfdetrBoxValues;
  for (int k = 0; k < kRfdetrBoxValues; ++k) {
    if (!std::isfinite(v[k])) return std::nullopt;
  }
  return NetworkBox{{(v[0] - 0.5 * v[2]) * net_width_, (v[1] - 0.5 * v[3]) * net_height_},
                    {(v[0] + 0.5 * v[2]) * net_width_, (v[1] + 0.5 * v[3]) * net_height_}};
}

bool RfdetrDecoder::paint(int row, const Instance& instance, std::uint8_t id, GreyImage& ids) {
  const std::size_t cells = static_cast<std::size_t>(outputs_.mask_width) * outputs_.mask_height;
  return sampler_.paint(outputs_.masks.data() + row * cells, 0.0F, instance, id, ids);
}

}  // namespace ygslam
