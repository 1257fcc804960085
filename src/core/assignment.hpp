// Who belongs to whom: the one-to-one assignment of least cost.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace ygslam {

/// Pairs rows with columns, as many as there are of the fewer, at the least sum of costs (shortest
/// augmenting paths; Jonker, Volgenant 1987).
/// @param cost all finite. @return per row its column, -1 = none.
[[nodiscard]] std::vector<int> assign(const Eigen::MatrixXd& cost);

}  // namespace ygslam
