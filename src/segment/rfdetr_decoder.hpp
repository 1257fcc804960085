// RF-DETR-Seg (Robinson et al., 2025) as the package rfdetr exports it: queries, each with a box, a
// logit per class (sigmoid, no background) and a mask of logits.
#pragma once

#include <span>

#include "segment/detections.hpp"
#include "segment/mask_sampler.hpp"

namespace ygslam {

/// Centre x, centre y, width, height in shares of the input.
inline constexpr int kRfdetrBoxValues = 4;

struct RfdetrOutputs {
  std::span<const float> boxes;   ///< queries x kRfdetrBoxValues
  std::span<const float> logits;  ///< queries x classes
  std::span<const float> masks;   ///< queries x mask_height x mask_width
  int mask_width = 0, mask_height = 0;
};

class RfdetrDecoder final : public OutputDecoder {
 public:
  /// @param classes one entry per logit of a query; must outlive the decoder, as the spans.
  RfdetrDecoder(const RfdetrOutputs& outputs, const ClassTable& classes, const Letterbox& box);

  [[nodiscard]] RowScores scores(const ClassSet& wanted) const override;
  [[nodiscard]] std::optional<NetworkBox> box(int row) const override;
  /// Outside its box a mask is left out.
  [[nodiscard]] bool paint(int row, const Instance& instance, std::uint8_t id,
                           GreyImage& ids) override;

 private:
  RfdetrOutputs outputs_;
  const ClassTable& classes_;
  int net_width_, net_height_;
  MaskSampler sampler_;
};

}  // namespace ygslam
