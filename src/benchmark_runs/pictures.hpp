// Tracking pictures for the report (the paper's Fig. 5): `ygslam inspect` once per sequence.
#pragma once

#include "benchmark_runs/bench_sequence.hpp"
#include "benchmark_runs/sweep_options.hpp"

namespace ygslam {

/// Where a sequence's pictures and inspect.json go.
[[nodiscard]] std::filesystem::path pictures_folder(const SweepOptions& options,
                                                    const BenchSequence& sequence);
/// True if the checks that the sweep asks for have been drawn, of the images as they are now.
[[nodiscard]] bool has_pictures(const SweepOptions& options, const BenchSequence& sequence);
/// To be called once they are drawn. @return kOutput.
[[nodiscard]] Status mark_pictures(const SweepOptions& options, const BenchSequence& sequence);
/// The command that draws them; the full system is shown where the sweep runs it.
[[nodiscard]] std::vector<std::string> inspect_command(const SweepOptions& options,
                                                       const BenchSequence& sequence);

}  // namespace ygslam
