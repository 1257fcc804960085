// The errors behind the statistics, pose by pose: for curves, coloured paths and other programs.
#pragma once

#include <string>

#include "eval/trajectory_errors.hpp"

namespace ygslam {

/// Relative errors and the poses between which they were measured.
struct RelativeSeries {
  IndexPairs intervals;  ///< indices into the pairs of poses, the first strictly increasing
  PoseErrors errors;     ///< one per interval
};

struct ErrorSeries {
  PosePairs pairs;      ///< the estimate already aligned to the truth
  PoseErrors absolute;  ///< one per pair
  RelativeSeries frames, seconds;
};

/// The columns of errors_csv, without newline:
/// t_s, the estimate's position, the true one [m], then ATE and the RPE over frames and over
/// seconds, each in metres and degrees. An RPE stands in the row of its interval's first pose.
inline constexpr const char* kErrorColumns =
    "t_s,x_m,y_m,z_m,truth_x_m,truth_y_m,truth_z_m,ate_m,ate_deg,rpe30_m,rpe30_deg,rpe1s_m,"
    "rpe1s_deg";

/// One line per pair; a cell without a value is empty. Stamps are the estimate's.
/// @param prefix put in front of every line, e.g. "name,".
[[nodiscard]] std::string error_rows(const ErrorSeries& series, const std::string& prefix = {});
/// Heading and rows.
[[nodiscard]] std::string errors_csv(const ErrorSeries& series);

}  // namespace ygslam
