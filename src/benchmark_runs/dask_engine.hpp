// Runs on other machines: each run's command is handed to a Dask worker by a child process, which
// stands here for the run (tools/report/dask_engine.py).
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "benchmark_runs/child_process.hpp"
#include "benchmark_runs/sweep_options.hpp"
#include "core/result.hpp"

namespace ygslam {

/// Asks all workers whether they see the program, the sequences and the results folder.
/// @return how many runs they make at a time; kOutput: no `distributed` in the Python that is used,
/// no scheduler, no workers, or one that cannot do the work (named).
[[nodiscard]] Result<int> engine_slots(const SweepOptions& options,
                                       const std::vector<BenchSequence>& sequences,
                                       const std::function<bool()>& stop);

/// What hands the command to a worker and waits. @param folder of the run's files; emptied there.
/// @param limit_s longest time on the worker, 0: none. @return kOutput if the tool is not there.
[[nodiscard]] Result<std::vector<std::string>> engine_command(
    const SweepOptions& options, const std::filesystem::path& folder, double limit_s,
    const std::vector<std::string>& command);

/// How the run ended on its worker. @param handing how the process of engine_command ended.
/// @return kOutput: the engine is gone.
[[nodiscard]] Result<ChildExit> exit_on_worker(const ChildExit& handing);

}  // namespace ygslam
