// A spread of a pose file's lines as numbers, for what is judged by many of them.
#pragma once

#include <algorithm>
#include <vector>

#include "io/trajectory_columns.hpp"

namespace ygslam {

/// So much of the lines must bear a reading out; the rest are faults that are told by line.
inline constexpr double kLeastShareOfPoses = 0.5;

/// A spread of the records with the usual number of fields, as numbers (NaN: no number).
struct PoseSample {
  std::size_t columns = 0;  ///< the most common number of fields
  std::vector<std::vector<double>> rows;
  std::vector<const PoseRecord*> records;

  template <typename Fits>
  [[nodiscard]] double share(const Fits& fits) const {
    const auto count = std::count_if(rows.begin(), rows.end(), fits);
    return rows.empty() ? 0 : static_cast<double>(count) / static_cast<double>(rows.size());
  }
  /// Of the steps from line to line.
  template <typename Fits>
  [[nodiscard]] double share_of_steps(const Fits& fits) const {
    std::size_t count = 0;
    for (std::size_t i = 1; i < rows.size(); ++i) count += fits(rows[i - 1], rows[i]) ? 1 : 0;
    return rows.size() < 2 ? 1 : static_cast<double>(count) / static_cast<double>(rows.size() - 1);
  }
};

/// Lines that follow each other directly, so that steps mean something: the first and the last.
[[nodiscard]] PoseSample sample_of(const std::vector<PoseRecord>& records);
/// The most common number of fields.
[[nodiscard]] std::size_t usual_columns(const std::vector<PoseRecord>& records);
/// Columns of text (frame ids, names of images) hold no pose.
[[nodiscard]] std::vector<std::size_t> columns_of_numbers(const PoseSample& sample);
[[nodiscard]] PoseSample only_columns(const PoseSample& sample,
                                      const std::vector<std::size_t>& columns);

}  // namespace ygslam
