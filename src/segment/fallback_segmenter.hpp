// A large network that hands over to a quick one where it does not keep up.
#pragma once

#include <functional>
#include <memory>

#include "segment/segmenter.hpp"

namespace ygslam {

struct FallbackConfig {
  double late_s = 0.33;  ///< a mask that takes longer is late
  int late_masks = 5;    ///< as many in a row: the other one takes over
};

/// Until `first` is late time and again; from then on what `make_second` makes, once, in the thread
/// that calls segment(). It stays with `first` where that fails. Masks of the second are marked
/// (Segmentation::by_fallback), and in_step() becomes its own; it may be asked from any thread.
[[nodiscard]] std::unique_ptr<Segmenter> make_fallback_segmenter(
    std::unique_ptr<Segmenter> first,
    std::function<Result<std::unique_ptr<Segmenter>>()> make_second,
    const FallbackConfig& config = {});

}  // namespace ygslam
