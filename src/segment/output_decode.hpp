// A network's output tensors, whatever its kind, to instances and masks of the recorded image.
#pragma once

#include <span>

#include "segment/detections.hpp"
#include "segment/output_kind.hpp"

namespace ygslam {

/// As it lies in memory: row-major, lengths known.
struct OutputTensor {
  std::span<const float> values;
  std::vector<std::size_t> lengths;
};

/// @param outputs in the network's order.
/// @return kModel: tensors of another shape than the layout's, which where it is open only a run
/// tells.
[[nodiscard]] Result<Decoded> decode_outputs(const OutputLayout& layout,
                                             const std::vector<OutputTensor>& outputs,
                                             const Letterbox& box, const DecodeConfig& config);

/// Size of a cell of the network's masks [px of its input].
[[nodiscard]] double mask_cell_px(const OutputLayout& layout,
                                  const std::vector<OutputTensor>& outputs, const Letterbox& box);

}  // namespace ygslam
