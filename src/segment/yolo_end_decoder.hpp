// End-to-end YOLO-seg (YOLO26): finished detections, no suppression needed,
// https://docs.ultralytics.com/guides/end2end-detection.
#pragma once

#include <span>

#include "segment/detections.hpp"
#include "segment/prototype_masks.hpp"

namespace ygslam {

/// x0, y0, x1, y1 [network px], score, class, coefficients
inline constexpr int kYoloEndValues = 6 + kPrototypes;

class YoloEndDecoder final : public OutputDecoder {
 public:
  /// @param detections rows x kYoloEndValues. @param classes must outlive the decoder.
  YoloEndDecoder(std::span<const float> detections, const ClassTable& classes,
                 const Prototypes& prototypes, const Letterbox& box);

  [[nodiscard]] RowScores scores(const ClassSet& wanted) const override;
  [[nodiscard]] std::optional<NetworkBox> box(int row) const override;
  [[nodiscard]] bool paint(int row, const Instance& instance, std::uint8_t id,
                           GreyImage& ids) override;

 private:
  [[nodiscard]] const float* values(int row) const {
    return detections_.data() + static_cast<std::size_t>(row) * kYoloEndValues;
  }

  std::span<const float> detections_;
  const ClassTable& classes_;
  PrototypeMasks masks_;
};

}  // namespace ygslam
