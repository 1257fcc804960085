// What a finished child process leaves behind, made into a record and errors.csv.
#pragma once

#include "benchmark_runs/child_process.hpp"
#include "benchmark_runs/sweep_options.hpp"

namespace ygslam {

/// Looks at the files in the run's folder, evaluates the trajectory against the truth and writes
/// errors.csv; run.json is left to the caller, and so are the record's
/// options.
/// @return kOutput if errors.csv cannot be written.
[[nodiscard]] Result<RunRecord> judge_run(const SweepOptions& options,
                                          const BenchSequence& sequence, const RunKey& key,
                                          const ChildExit& exit);

/// One line for people: how the run went.
[[nodiscard]] std::string describe_run(const std::filesystem::path& folder,
                                       const BenchSequence& sequence, const RunRecord& record);

}  // namespace ygslam
