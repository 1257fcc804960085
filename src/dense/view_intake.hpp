// A frame as the dense map keeps it: what of its pixels is a surface, a mover or an object.
#pragma once

#include "dense/dense_config.hpp"
#include "dense/dense_frame.hpp"

namespace ygslam {

struct IncomingView {
  DepthView images;                             ///< its objects are numbers of observations, from 1
  std::vector<ObjectObservation> observations;  ///< one for each detection
};

/// Excludes movers with a margin, and objects that move; drops from masks what depth says is
/// something else.
[[nodiscard]] IncomingView incoming_view(const DenseFrame& frame, const DenseMapConfig& config,
                                         const Camera& camera);

}  // namespace ygslam
