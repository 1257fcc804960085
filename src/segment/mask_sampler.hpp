// Brings a mask on a network's grid to the recorded image.
#pragma once

#include <cstdint>
#include <vector>

#include "segment/letterbox.hpp"
#include "segment/segmenter.hpp"

namespace ygslam {

/// Cells [x0, x1] x [y0, y1] of a mask, empty if x1 < x0 or y1 < y0.
struct MaskCells {
  int x0 = 0, x1 = -1, y0 = 0, y1 = -1;
  [[nodiscard]] bool empty() const { return x1 < x0 || y1 < y0; }
};

class MaskSampler {
 public:
  /// @param mask_width, mask_height cells of a mask, which cover the network's input evenly.
  MaskSampler(const Letterbox& box, int mask_width, int mask_height);

  [[nodiscard]] int mask_width() const { return static_cast<int>(line_.size()); }
  /// The cells that paint() reads.
  [[nodiscard]] MaskCells cells_of(const Instance& instance) const;
  /// Writes `id` where the mask, interpolated, is above `threshold`, inside the instance's box, and
  /// `ids` is still 0. NaN is outside the mask. @return false if the mask has no pixel.
  [[nodiscard]] bool paint(const float* mask, float threshold, const Instance& instance,
                           std::uint8_t id, GreyImage& ids);

 private:
  /// Where the samples of one image axis lie between cells.
  struct Axis {
    std::vector<int> low;       ///< cell before the sample; the next one is min(low + 1, last)
    std::vector<float> weight;  ///< of the cell after it
    int last = 0;
  };
  struct Pixels {
    int u0 = 0, u1 = 0, v0 = 0, v1 = 0;  ///< [u0, u1) x [v0, v1)
    [[nodiscard]] bool empty() const { return u0 >= u1 || v0 >= v1; }
  };
  static Axis make_axis(int size, double scale, double pad, double stride, int cells);
  [[nodiscard]] Pixels pixels_of(const Instance& instance) const;

  Axis columns_, rows_;
  std::vector<float> line_;  ///< one image row's worth, interpolated between two rows of cells
};

}  // namespace ygslam
