// The scales of the image pyramid that features are found in.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/check.hpp"

namespace ygslam {

class PyramidScales {
 public:
  /// @param levels >= 1. @param factor between levels, > 1.
  PyramidScales(int levels, double factor) : factor_(factor), log_factor_(std::log(factor)) {
    CHECK(levels >= 1 && factor > 1);
    for (int octave = 0; octave < levels; ++octave) scale_.push_back(std::pow(factor, octave));
  }

  [[nodiscard]] double factor() const { return factor_; }
  [[nodiscard]] int levels() const { return static_cast<int>(scale_.size()); }
  /// Pixels of a level times this are pixels of the image.
  [[nodiscard]] double of(int octave) const { return scale_[static_cast<std::size_t>(octave)]; }
  /// The octave at which something `scale` times as large in the image as at octave 0 is found
  /// again; the nearest there is.
  [[nodiscard]] int octave_at(double scale) const {
    // A scale that is one of the levels' up to rounding is that level's.
    return static_cast<int>(std::clamp(std::ceil(std::log(scale) / log_factor_ - 1e-6), 0.0,
                                       static_cast<double>(levels() - 1)));
  }

 private:
  std::vector<double> scale_;
  double factor_;
  double log_factor_;
};

}  // namespace ygslam
