// Who looks at the dense map while it is made.
#pragma once

#include <functional>

#include "dense/dense_map.hpp"

namespace ygslam {

/// Called with the map by the thread that makes it, after it changed; either may be empty.
struct DenseSink {
  /// At most every `every_s`, and for no more than a tenth of the thread's time.
  std::function<void(DenseMap&)> look{};
  double every_s = 1;
  /// At once, for what cannot wait and is quick: for no more than a twentieth, but where it takes
  /// longer than 7 ms.
  std::function<void(DenseMap&)> look_at_once{};
};

}  // namespace ygslam
