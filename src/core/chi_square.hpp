// Quantiles of the chi-square distribution.
#pragma once

namespace ygslam {

/// Six degrees of freedom, as a pose has: 99.9 % are less.
inline constexpr double kMostChiSquare6 = 22.5;

}  // namespace ygslam
