// Absolute and relative errors of an associated, aligned trajectory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "eval/associate.hpp"

namespace ygslam {

struct Statistics {
  std::size_t count = 0;
  double rmse = 0, mean = 0, median = 0;
  double std = 0;  ///< of the population (divided by n)
  double min = 0, max = 0;
};
/// @param errors at least one value.
[[nodiscard]] Statistics summarize(std::span<const double> errors);

/// One error per pair or per pair of pairs.
struct PoseErrors {
  std::vector<double> trans_m;
  std::vector<double> rot_deg;  ///< rotation angle, 0 to 180
};

/// F_i = Q_i^-1 T P_i with truth Q and aligned estimate T P: the error that eq. (17) of the YG-SLAM
/// paper averages.
/// @param pairs with the estimate already aligned.
[[nodiscard]] PoseErrors absolute_errors(const PosePairs& pairs);

/// Indices (i, j) of two poses.
using IndexPairs = std::vector<std::pair<std::size_t, std::size_t>>;
/// All (i, i + delta). @param delta >= 1.
[[nodiscard]] IndexPairs frame_intervals(std::size_t count, std::size_t delta);
/// All (i, j) where j is the pose nearest to delta_s after i and within tolerance_s of that.
/// @param poses in order of time.
[[nodiscard]] IndexPairs time_intervals(std::span<const StampedPose> poses, double delta_s,
                                        double tolerance_s);
/// Median time between consecutive poses [s]; 0 for fewer than two.
[[nodiscard]] double median_interval_s(std::span<const StampedPose> poses);

/// F_i = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j), eq. (18) of the paper with j = i + delta.
[[nodiscard]] PoseErrors relative_errors(const PosePairs& pairs, const IndexPairs& intervals);

}  // namespace ygslam
