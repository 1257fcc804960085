// What a results folder holds already of the runs of a sequence.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "benchmark_runs/sweep_options.hpp"

namespace ygslam {

struct EarlierRuns {
  std::map<std::string, RunRecord> done;  ///< by the run's folder, those that are not made again
  std::vector<std::string> repeated;      ///< "runs/ID/MODE/NN: why", one line each
  std::optional<std::string> changed;     ///< what is not as it was when the runs were made
};

/// Reads runs/ID. A run that was ended from outside, ran out of a time that has grown, or whose
/// files are damaged is not done; one without run.json never happened and is not told.
/// @param comparable options of now.
/// @return kOutput naming a run.json of another version or of other options.
[[nodiscard]] Result<EarlierRuns> read_earlier_runs(const SweepOptions& options,
                                                    const nlohmann::json& comparable,
                                                    const BenchSequence& sequence);

/// How two makes differ: "made by version 1, this is 2"; nothing if they are the same.
[[nodiscard]] std::optional<std::string> other_make(const std::string& version,
                                                    const nlohmann::json& options,
                                                    const std::string& version_now,
                                                    const nlohmann::json& options_now);
/// The refusal of results that are damaged or of another make. @param what begins with the file.
[[nodiscard]] Error not_ours(const std::string& what);
/// The same for a file of another make.
[[nodiscard]] Error of_other_make(const std::filesystem::path& file, const std::string& what);

}  // namespace ygslam
