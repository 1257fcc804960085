// A results folder read back: the figures of every run, medians and spreads over them.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "benchmark_runs/run_record.hpp"
#include "benchmark_runs/sweep_file.hpp"
#include "core/result.hpp"

namespace ygslam {

/// The figures of a run that are told and compared; of all, less is better.
enum class Figure { kAte, kRpe30Trans, kRpe30Rot, kRpe1sTrans, kRpe1sRot, kTrackTime };
inline constexpr std::array kFigures = {Figure::kAte,      Figure::kRpe30Trans,
                                        Figure::kRpe30Rot, Figure::kRpe1sTrans,
                                        Figure::kRpe1sRot, Figure::kTrackTime};
struct FigureInfo {
  const char* key;    ///< for JSON: ate_m, rpe30_m, ...
  const char* title;  ///< for people, with unit
  const char* place;  ///< JSON pointer in metrics.json
  int decimals;
};
[[nodiscard]] const FigureInfo& info_of(Figure figure);

struct RunFigures {
  RunStatus status = RunStatus::kOk;
  bool timings_valid = true;
  std::optional<double> coverage;
  std::array<std::optional<double>, kFigures.size()> values;  ///< by Figure
};

/// Median and range over the runs that gave a number.
struct Spread {
  std::size_t count = 0;
  double median = 0, min = 0, max = 0;
};

/// All runs of a sequence in a mode.
struct ResultRow {
  std::string sequence_id, sequence, kind, mode;
  std::vector<RunFigures> runs;

  /// @return nothing if no run gave a number. Runs that failed or were lost give none, except lost
  /// ones the time: it does not matter for how long they were tracked.
  [[nodiscard]] std::optional<Spread> spread(Figure figure) const;
  [[nodiscard]] std::size_t good_runs() const;
  [[nodiscard]] bool timings_valid() const;
};

struct Results {
  SweepFile sweep;
  std::vector<ResultRow> rows;
  std::vector<std::string> unusable;  ///< "name: why", sequences without runs
  std::vector<std::string> damaged;   ///< "runs/ID/MODE/NN: why", runs whose figures cannot be read
};

/// A run whose metrics.json cannot be read or makes no sense is a failed one, see `damaged`.
/// @return kInput: no results folder, or a sweep.json or run.json that cannot be read.
[[nodiscard]] Result<Results> read_results(const std::filesystem::path& folder);

/// "0.0132 (0.0130 to 0.0135)", one number alone where there is no spread.
[[nodiscard]] std::string format_spread(const Spread& spread, int decimals);

[[nodiscard]] nlohmann::ordered_json to_json(const Spread& spread);
/// Each row with its runs, good ones and spreads (null where no run gave a number).
[[nodiscard]] nlohmann::ordered_json to_json(const Results& results);

/// A table for people, one line a sequence and mode; failed runs are counted in it.
[[nodiscard]] std::string format_results(const Results& results);

}  // namespace ygslam
