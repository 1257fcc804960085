// What the user asked of a sweep, and which of it decides the outcome of a run.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "benchmark_runs/bench_sequence.hpp"
#include "benchmark_runs/child_process.hpp"
#include "benchmark_runs/run_record.hpp"

namespace ygslam {

/// What can be done about moving things, in the customary order.
inline constexpr std::array<std::string_view, 4> kSweepModes = {"off", "geometry", "semantic",
                                                                "full"};
/// Of each sequence in each mode.
inline constexpr int kMostRuns = 1000;
/// The keys of comparable_options, in the order in which they are told.
inline constexpr std::array kComparableKeys = {"way",   "seed",          "segmenter", "precision",
                                               "model", "model_content", "config"};
/// Those of them that say where masks come from; nothing to modes without masks.
inline constexpr std::array kMaskKeys = {"segmenter", "precision", "model", "model_content"};

enum class Schedule { kFile, kRealtime, kDeterministic };

struct SweepOptions {
  std::filesystem::path root;          ///< where the sequences are
  std::filesystem::path out;           ///< where the results go
  std::vector<std::string> sequences;  ///< names; none: all
  std::vector<std::string> modes;      ///< off, geometry, semantic, full
  int runs = 5;                        ///< of each sequence in each mode
  int jobs = 1;  ///< runs at the same time; 0: as many as the engine has room for
  Schedule schedule = Schedule::kFile;
  std::optional<double> run_limit_s;  ///< longest time of a run, 0 = none; see run_limit_s()
  double patience_s = kPatience_s;    ///< for a run that is asked to end
  std::uint64_t seed = 0;             ///< of the first run; each further run has the next
  std::string segmenter =
      "model";  ///< as --segmenter of run; DIR of masks:DIR relative: inside the sequence
  std::filesystem::path model;
  std::string precision;                      ///< of the network, as configured
  std::map<std::string, std::string> config;  ///< settings that are not the default
  std::string version, machine;
  std::filesystem::path program;  ///< whose `run` command does the work
  std::string engine;             ///< HOST:PORT of a Dask scheduler; empty: runs are made here
};

[[nodiscard]] std::string_view name_of(Schedule schedule);
[[nodiscard]] bool mode_uses_masks(std::string_view mode);
[[nodiscard]] bool any_uses_masks(const std::vector<std::string>& modes);

/// Everything but sequence, mode and number that makes a run what it is; no machine paths.
/// The model is told by its file's name and content. Mask keys are null where no mode uses masks.
[[nodiscard]] nlohmann::json comparable_options(const SweepOptions& options);
/// Those that decide the outcome of a run in this mode; the mask keys of others are null.
[[nodiscard]] nlohmann::json options_of_mode(nlohmann::json comparable, std::string_view mode);
/// Those of now; where they tell nothing of masks, what an earlier call has told.
[[nodiscard]] nlohmann::json merged_options(nlohmann::json now, const nlohmann::json& before);

/// The first difference between two of these: "seed was 0, is now 3"; nothing if they are equal.
/// Mask keys count only where both sides tell them.
[[nodiscard]] std::optional<std::string> difference(const nlohmann::json& before,
                                                    const nlohmann::json& now);

/// How long a run may take [s], 0 = as long as it likes: what the user said, else ten minutes and
/// thirty times the duration of the sequence.
[[nodiscard]] double run_limit_s(const SweepOptions& options, const BenchSequence& sequence);

[[nodiscard]] std::uint64_t seed_of(const SweepOptions& options, const RunKey& key);
/// Where the segmenter reads masks of this sequence; nothing if it does not.
[[nodiscard]] std::optional<std::filesystem::path> masks_folder(const SweepOptions& options,
                                                                const BenchSequence& sequence);
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
