// Draws the mask of one detection: a linear combination of the network's prototype masks, brought
// to the recorded image.
#pragma once

#include <array>
#include <vector>

#include "segment/yolo_decode.hpp"

namespace ygslam {

using MaskCoefficients = std::array<float, kYoloCoefficients>;

class MaskPainter {
 public:
  /// Both must outlive the painter.
  MaskPainter(const YoloOutputs& outputs, const Letterbox& box);

  /// Writes `id` where the mask is set, inside the instance's box, and `ids` is still 0.
  /// sigmoid(x) > 0.5 is x > 0, so no sigmoid is computed; NaN prototypes are outside the mask.
  /// @return false if the mask has no pixel.
  [[nodiscard]] bool paint(const MaskCoefficients& coefficients, const Instance& instance,
                           std::uint8_t id, GreyImage& ids);

 private:
  /// Where the samples of one image axis lie between prototype cells.
  struct Axis {
    std::vector<int> low;       ///< cell before the sample; the next one is min(low + 1, last)
    std::vector<float> weight;  ///< of the cell after it
    int last = 0;
  };
  static Axis make_axis(int size, double scale, double pad, double stride, int cells);
  void combine(const MaskCoefficients& coefficients, int x0, int x1, int y0, int y1);

  const YoloOutputs& outputs_;
  Axis columns_, rows_;
  std::vector<float> linear_;  ///< coefficient-weighted sum of the prototypes, proto_height x width
  std::vector<float> line_;    ///< one image row's worth, interpolated between two prototype rows
};

}  // namespace ygslam
