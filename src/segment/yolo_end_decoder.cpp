#include "segment/yolo_end_decoder.hpp"

#include "segment/row_labels.hpp"

namespace ygslam {

YoloEndDecoder::YoloEndDecoder(std::span<const float> detections, const ClassTable& classes,
                               const Prototypes& prototypes, const Letterbox& box)
    : detections_(detections), classes_(classes), masks_(prototypes, box) {
  CHECK(detections.size() % kYoloEndValues == 0);
}

RowScores YoloEndDecoder::scores(const ClassSet& wanted) const {
  constexpr int kScore = 4, kLabel = 5;
  RowScores best(static_cast<int>(detections_.size() / kYoloEndValues));
  for (int row = 0; row < std::ssize(best.score); ++row)
    take_labelled(row, values(row)[kScore], values(row)[kLabel], classes_, wanted, best);
  return best;
}

std::optional<NetworkBox> YoloEndDecoder::box(int row) const { return corner_box(values(row)); }

bool YoloEndDecoder::paint(int row, const Instance& instance, std::uint8_t id, GreyImage& ids) {
  constexpr int kCoefficients = 6;
  return masks_.paint(values(row) + kCoefficients, 1, instance, id, ids);
}

}  // namespace ygslam
