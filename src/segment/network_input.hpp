// How each kind of network wants its image.
#pragma once

#include "segment/letterbox.hpp"
#include "segment/output_kind.hpp"
#include "segment/planar.hpp"

namespace ygslam {

struct InputForm {
  Placement placement = Placement::kCentred;
  Normalisation colours;
  int multiple_px = 1;  ///< of which the input's sides are multiples
};

[[nodiscard]] InputForm input_form(OutputKind kind);

}  // namespace ygslam
