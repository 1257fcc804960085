// Which pose of the estimate belongs to which pose of the truth.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "io/trajectory.hpp"

namespace ygslam {

/// Poses at (nearly) the same time, one entry per pair, in order of time.
struct PosePairs {
  std::vector<StampedPose> truth;
  std::vector<StampedPose> estimate;

  [[nodiscard]] std::size_t size() const { return truth.size(); }
};

/// For each of `stamps` the position of the nearest in `among` (on a tie the earlier one).
/// @param stamps,among in order of time; `among` not empty.
[[nodiscard]] std::vector<std::size_t> nearest_stamps(std::span<const Timestamp> stamps,
                                                      std::span<const Timestamp> among);

/// Each stamp of the shorter trajectory (of the estimate, if they are equally long) takes its
/// nearest in the other if that is within max_diff_s; two may share one. Both in order of time.
[[nodiscard]] PosePairs associate(std::span<const StampedPose> truth,
                                  std::span<const StampedPose> estimate, double max_diff_s);

/// Share of the frames for which the estimate has a pose: each pose of the estimate counts for its
/// nearest frame within max_diff_s. @return 0 without frames.
[[nodiscard]] double coverage(std::span<const Timestamp> frames,
                              std::span<const StampedPose> estimate, double max_diff_s);

}  // namespace ygslam
