// run.json: how one run of a sweep ended. It is written last; without it the run did not happen.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "core/result.hpp"

namespace ygslam {

enum class RunStatus {
  kOk,
  kLost,      ///< tracking was lost for longer than run.max_lost_share
  kFailed,    ///< it ended with an error
  kCrashed,   ///< a signal ended it
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
  bool timings_valid = true;  ///< no other run beside it
  std::string version;
  std::string sequence_fingerprint;
  nlohmann::json options;  ///< that decide the outcome, see comparable_options
};

[[nodiscard]] nlohmann::ordered_json to_json(const RunRecord& record);
/// @return kInput naming the file: unreadable, no JSON, of another format, or a value of the wrong
/// type.
[[nodiscard]] Result<RunRecord> read_run_record(const std::filesystem::path& file);

}  // namespace ygslam
