#include "segment/rtmdet_decoder.hpp"

#include "segment/row_labels.hpp"

namespace ygslam {

RtmdetDecoder::RtmdetDecoder(const RtmdetOutputs& outputs, const ClassTable& classes,
                             const Letterbox& box)
    : outputs_(outputs),
      classes_(classes),
      mask_cells_(static_cast<std::size_t>(box.net_width) * box.net_height),
      sampler_(box, box.net_width, box.net_height) {
  CHECK(outputs.boxes.size() == outputs.labels.size() * kRtmdetBoxValues);
  CHECK(outputs.masks.size() % mask_cells_ == 0);
}

RowScores RtmdetDecoder::scores(const ClassSet& wanted) const {
  constexpr int kScore = 4;
  RowScores best(static_cast<int>(outputs_.labels.size()));
  for (int row = 0; row < std::ssize(outputs_.labels); ++row)
    take_labelled(row, values(row)[kScore], outputs_.labels[row], classes_, wanted, best);
  return best;
}

std::optional<NetworkBox> RtmdetDecoder::box(int row) const { return corner_box(values(row)); }

bool RtmdetDecoder::paint(int row, const Instance& instance, std::uint8_t id, GreyImage& ids) {
  constexpr float kInside = 0.5F;
  const std::size_t first = static_cast<std::size_t>(row) * mask_cells_;
  if (first + mask_cells_ > outputs_.masks.size()) return false;
  return sampler_.paint(outputs_.masks.data() + first, kInside, instance, id, ids);
}

}  // namespace ygslam
