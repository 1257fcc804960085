// RTMDet-Ins (Lyu et al., 2022) as MMDeploy exports it for ONNX Runtime: detections after
// suppression, masks as probabilities at the size of the input.
#pragma once

#include <span>

#include "segment/detections.hpp"
#include "segment/mask_sampler.hpp"

namespace ygslam {

inline constexpr int kRtmdetBoxValues = 5;      ///< x0, y0, x1, y1 [network px], score
inline constexpr int kRtmdetMaskStride_px = 8;  ///< its masks are interpolated from this grid

/// The export pads the boxes by one row of score 0 that has no mask: masks may be fewer than boxes.
struct RtmdetOutputs {
  std::span<const float> boxes;   ///< rows x kRtmdetBoxValues
  std::span<const float> labels;  ///< rows
  std::span<const float> masks;   ///< at most rows x net_height x net_width, 0..1
};

class RtmdetDecoder final : public OutputDecoder {
 public:
  /// @param classes must outlive the decoder, as the spans.
  RtmdetDecoder(const RtmdetOutputs& outputs, const ClassTable& classes, const Letterbox& box);

  [[nodiscard]] RowScores scores(const ClassSet& wanted) const override;
  [[nodiscard]] std::optional<NetworkBox> box(int row) const override;
  /// Outside its box a mask is left out.
  [[nodiscard]] bool paint(int row, const Instance& instance, std::uint8_t id,
                           GreyImage& ids) override;

 private:
  [[nodiscard]] const float* values(int row) const {
    return outputs_.boxes.data() + static_cast<std::size_t>(row) * kRtmdetBoxValues;
  }

  RtmdetOutputs outputs_;
  const ClassTable& classes_;
  std::size_t mask_cells_;
  MaskSampler sampler_;
};

}  // namespace ygslam
