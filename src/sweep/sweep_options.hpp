// What the user asked of a sweep, and which of it decides the outcome of a run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "sweep/bench_sequence.hpp"
#include "sweep/run_record.hpp"

namespace ygslam {

enum class Schedule { kFile, kRealtime, kDeterministic };

struct SweepOptions {
  std::filesystem::path root;          ///< where the sequences are
  std::filesystem::path out;           ///< where the results go
  std::vector<std::string> sequences;  ///< names; none: all
  std::vector<std::string> modes;      ///< off, geometry, semantic, full
  int runs = 5;                        ///< of each sequence in each mode
  int jobs = 1;                        ///< runs at the same time
  Schedule schedule = Schedule::kFile;
  std::uint64_t seed = 0;           ///< of the first run; each further run has the next
  std::string segmenter = "model";  ///< model, none or masks:DIR (relative: inside the sequence)
  std::filesystem::path model;
  std::string precision;                      ///< of the network, as configured
  std::map<std::string, std::string> config;  ///< settings that are not the default
  std::string version, machine;
  std::filesystem::path program;  ///< whose `run` command does the work
};

[[nodiscard]] std::string_view name_of(Schedule schedule);
[[nodiscard]] bool mode_uses_masks(const std::string& mode);

/// Everything but sequence, mode and number that makes a run what it is; no machine paths.
/// The model is told by its file's name and content.
[[nodiscard]] nlohmann::json comparable_options(const SweepOptions& options);

/// The first difference between two of these: "seed was 0, is now 3"; nothing if they are equal.
[[nodiscard]] std::optional<std::string> difference(const nlohmann::json& before,
                                                    const nlohmann::json& now);

[[nodiscard]] std::uint64_t seed_of(const SweepOptions& options, const RunKey& key);
/// Where the masks come from, as options of the child.
[[nodiscard]] std::vector<std::string> mask_options(const SweepOptions& options,
                                                    const BenchSequence& sequence);
/// The child's command line.
[[nodiscard]] std::vector<std::string> run_command(const SweepOptions& options,
                                                   const BenchSequence& sequence,
                                                   const RunKey& key);
/// The same as a person would type it where the sequences and the results lie.
[[nodiscard]] std::string shown_command(const SweepOptions& options, const BenchSequence& sequence,
                                        const RunKey& key);

/// The runs in their order: the first of every sequence in every mode, then the second ...; so that
/// what slows the machine for a while slows all modes alike. Unusable sequences have none.
[[nodiscard]] std::vector<RunKey> planned_runs(const SweepOptions& options,
                                               const std::vector<BenchSequence>& sequences);

}  // namespace ygslam
