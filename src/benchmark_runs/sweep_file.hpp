// sweep.json: what a results folder holds and how it was made. docs/evaluation.md has the format.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "benchmark_runs/sweep_options.hpp"
#include "core/result.hpp"

namespace ygslam {

struct SweepFacts {
  std::string started;  ///< ISO 8601, UTC
  double wall_s = 0;    ///< of all calls together
  bool timings_valid = true;
};

/// @param comparable of the options. @param earlier the file as an earlier call left it, or null:
/// its sequences, modes and runs that are not asked for now stay in the list.
/// @return the document but for `complete`.
[[nodiscard]] nlohmann::ordered_json sweep_json(const SweepOptions& options,
                                                const nlohmann::json& comparable,
                                                const std::vector<BenchSequence>& sequences,
                                                const SweepFacts& facts,
                                                const nlohmann::json& earlier);

/// The runs that all calls together asked for, of a sweep.json or null: each sequence's
/// `runs_asked`, or all modes and runs where an older file has none. Unusable sequences have none.
[[nodiscard]] std::vector<RunKey> asked_runs(const nlohmann::json& sweep);

struct SweepFile {
  std::string version, started;
  double wall_s = 0;
  nlohmann::json options;  ///< comparable ones, see comparable_options
  nlohmann::json json;     ///< the whole
};
/// @return kInput naming the file: not there, no JSON, of another format, a key missing.
[[nodiscard]] Result<SweepFile> read_sweep_file(const std::filesystem::path& file);
/// The same from its text. @param name of the file, for messages.
[[nodiscard]] Result<SweepFile> parse_sweep_file(std::string_view text, const std::string& name);

}  // namespace ygslam
