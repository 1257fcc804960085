// run.json: how one run of a sweep ended. It is written last; without it the run did not happen.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace ygslam {

enum class RunStatus {
  kOk,
  kLost,      ///< tracking was lost for longer than run.max_lost_share
  kFailed,    ///< it ended with an error
  kCrashed,   ///< a signal ended it
  kTimedOut,  ///< it was not done when its time was over
  kBadTruth,  ///< it ran, but its trajectory cannot be compared with the truth
};
[[nodiscard]] std::string_view name_of(RunStatus status);

/// Which run of a sweep.
struct RunKey {
  std::string sequence_id, mode;
  int run = 1;  ///< from 1

  /// runs/ID/MODE/NN, relative to the results.
  [[nodiscard]] std::filesystem::path folder() const;
};

struct RunRecord {
  RunStatus status = RunStatus::kOk;
  int exit_code = 0;
  int signal = 0;
  std::optional<std::string> error;  ///< one line
  std::string command;               ///< as one would type it, without the folders of this machine
  std::string mode;
  int run = 1;
  std::uint64_t seed = 0;
  double wall_s = 0;
  double limit_s = 0;         ///< the longest that it was allowed to take; 0: no limit
  bool timings_valid = true;  ///< no other run beside it
  std::string version;
  std::string sequence_fingerprint;
  std::string masks_fingerprint;             ///< empty where it read no recorded masks
  std::map<std::string, std::string> files;  ///< name to fingerprint, as the run left them
  nlohmann::json options;                    ///< that decide the outcome, see comparable_options
};

/// Whether a run's figures count: it came to its end, or was lost on the way.
[[nodiscard]] bool has_figures(RunStatus status);
/// False for runs that a repetition may end otherwise: those that were ended from outside, and
/// those whose time was over where there is more of it now.
/// @param limit_s of a repetition, 0 = none.
[[nodiscard]] bool is_final(const RunRecord& record, double limit_s);
/// Whether somebody ends programs with this signal; the others are a program's own faults.
[[nodiscard]] bool comes_from_outside(int signal);

[[nodiscard]] nlohmann::ordered_json to_json(const RunRecord& record);
/// @return kInput naming the file: unreadable, no JSON, of another format, or a value of the wrong
/// type.
[[nodiscard]] Result<RunRecord> read_run_record(const std::filesystem::path& file);
/// The same from its text. @param name of the file, for messages.
[[nodiscard]] Result<RunRecord> parse_run_record(std::string_view text, const std::string& name);

}  // namespace ygslam
