// Who looks at the dense map while it is made.
#pragma once

#include <functional>

#include "dense/dense_map.hpp"

namespace ygslam {

/// Called with the map by the thread that makes it, after it changed: at most every `every_s`, and
/// for no more than a tenth of its time.
struct DenseSink {
  std::function<void(DenseMap&)> look{};  ///< may be empty
  double every_s = 1;
};

}  // namespace ygslam
