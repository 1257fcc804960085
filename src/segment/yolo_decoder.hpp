// YOLOv8-seg and YOLO11-seg in Ultralytics' standard export: boxes, scores and mask coefficients of
// every cell, https://docs.ultralytics.com/tasks/segment.
#pragma once

#include <span>

#include "segment/detections.hpp"
#include "segment/prototype_masks.hpp"

namespace ygslam {

inline constexpr int kYoloBoxValues = 4;  ///< centre x, centre y, width, height [network px]
inline constexpr int kYoloOtherChannels = kYoloBoxValues + kPrototypes;  ///< beside the classes'

class YoloDecoder final : public OutputDecoder {
 public:
  /// @param detections channels x cells, row-major: box, a score per class, coefficients.
  /// @param classes one entry per class of the network; must outlive the decoder, as the spans.
  YoloDecoder(std::span<const float> detections, const ClassTable& classes,
              const Prototypes& prototypes, const Letterbox& box);

  [[nodiscard]] RowScores scores(const ClassSet& wanted) const override;
  [[nodiscard]] std::optional<NetworkBox> box(int row) const override;
  [[nodiscard]] bool paint(int row, const Instance& instance, std::uint8_t id,
                           GreyImage& ids) override;

 private:
  [[nodiscard]] const float* channel(std::size_t k) const {
    return detections_.data() + k * cells_;
  }

  std::span<const float> detections_;
  const ClassTable& classes_;
  std::size_t cells_;
  PrototypeMasks masks_;
};

}  // namespace ygslam
