// `ygslam eval --plot`: a picture of the trajectories and their errors, through matplotlib.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "eval/report.hpp"

namespace ygslam {

struct PlottedEstimate {
  std::string name;
  const Evaluation* evaluation;  ///< not null
};

/// Whether a file's name ends in a kind of picture that can be written (svg, png, pdf).
[[nodiscard]] bool is_plot_file(const std::filesystem::path& file);

/// Writes the picture atomically. @param truth the whole true trajectory.
/// @return kOutput: no script, no matplotlib, or the file cannot be written.
[[nodiscard]] Status write_plot(const std::filesystem::path& file,
                                std::span<const StampedPose> truth,
                                std::span<const PlottedEstimate> estimates);

}  // namespace ygslam
