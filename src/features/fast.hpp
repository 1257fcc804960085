// FAST-9/16 corners (Rosten & Drummond 2006), with the score as a map rather than a yes or no.
#pragma once

#include <cstdint>
#include <vector>

#include "image/padded_image.hpp"

namespace ygslam {

/// A corner of one pyramid level.
struct Corner {
  std::int16_t u = 0;  ///< pixel of the level
  std::int16_t v = 0;
  float score = 0;  ///< FAST score, later the strength that ranks the corner
};

/// FAST-9 score of a pixel: the largest t such that nine contiguous pixels of the 16-pixel circle
/// of radius 3 are all at least t brighter, or all at least t darker, than the centre. A pixel is a
/// corner at threshold t if its score exceeds t. One pixel at a time: the referee of the vector
/// code.
[[nodiscard]] int fast_score(const std::uint8_t* pixel, int stride);

/// Scores of pixels [begin, end) of a row, 0 where they do not exceed the threshold.
/// May write up to 31 entries beyond `end`; `scores[0]` belongs to pixel `begin`.
void fast_score_row(const std::uint8_t* row, int stride, int begin, int end, int threshold,
                    std::uint8_t* scores);

/// Finds the corners of a level that are maximal in their 3x3 neighbourhood.
class FastDetector {
 public:
  /// Corners in raster order. @param margin_px no corner nearer to the border, >= 4.
  /// The image is cut into cells of about cell_px; a cell keeps the corners above `threshold`, or,
  /// if it has none, those above `low_threshold`, so that poor regions are not left empty.
  void detect(const PaddedImage& image, int margin_px, int cell_px, int threshold,
              int low_threshold, std::vector<Corner>& corners);

 private:
  void suppress_row(int v, int begin, int count, std::vector<Corner>& corners);

  std::vector<std::uint8_t> rows_[3];  // scores of the rows above, here and below
  std::vector<std::uint8_t> cell_has_strong_;
};

}  // namespace ygslam
