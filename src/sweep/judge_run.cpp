#include "sweep/judge_run.hpp"

#include <cstring>

#include "core/log.hpp"  // brings {fmt}
#include "eval/report.hpp"
#include "io/atomic_file.hpp"
#include "io/json_text.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

std::string signal_name(int signal) {
  const char* name = sigabbrev_np(signal);
  return name != nullptr ? std::string("SIG") + name : "signal " + std::to_string(signal);
}

// Messages of the child name files of this machine.
std::string tidy(std::string text, const SweepOptions& options, const BenchSequence& sequence) {
  const std::string out = options.out.string() + "/";
  for (std::size_t at = 0; (at = text.find(out, at)) != std::string::npos;) {
    text.erase(at, out.size());
  }
  return without_folder(std::move(text), sequence);
}

std::string crash_text(const ChildExit& exit) {
  const std::string said = last_error_line(exit.errors);
  return "ended by " + signal_name(exit.signal) + (said.empty() ? "" : "; last said: " + said);
}

std::string failure_text(const ChildExit& exit) {
  const std::string said = last_error_line(exit.errors);
  return said.empty() ? "exit code " + std::to_string(exit.exit_code) : said;
}

// Errors of the trajectory against the truth, as a file.
Status write_errors(const fs::path& folder, const BenchSequence& sequence) {
  const auto truth = read_tum_trajectory(*sequence.groundtruth);
  if (!truth.ok()) return truth.error();
  const auto estimate = read_tum_trajectory(folder / "trajectory.txt");
  if (!estimate.ok()) return estimate.error();
  const auto evaluation = evaluate_in_detail(*truth, *estimate);
  if (!evaluation.ok()) {
    return Error{ErrorKind::kInput,
                 sequence.groundtruth->string() + ": " + evaluation.error().message};
  }
  return write_file_atomically(folder / "errors.csv", errors_csv(evaluation->series));
}

double number_at(const nlohmann::json& json, const char* pointer) {
  const nlohmann::json::json_pointer at(pointer);
  return json.contains(at) && json[at].is_number() ? json[at].get<double>() : -1;
}

}  // namespace

Result<RunRecord> judge_run(const SweepOptions& options, const BenchSequence& sequence,
                            const RunKey& key, const ChildExit& exit) {
  RunRecord record;
  record.exit_code = exit.exit_code;
  record.signal = exit.signal;
  record.command = shown_command(options, sequence, key);
  record.mode = key.mode;
  record.run = key.run;
  record.seed = seed_of(options, key);
  record.wall_s = exit.wall_s;
  record.timings_valid = options.jobs == 1;
  record.version = options.version;
  record.sequence_fingerprint = sequence.fingerprint;
  const fs::path folder = options.out / key.folder();
  std::error_code code;
  if (exit.signal != 0) {
    record.status = RunStatus::kCrashed;
    record.error = tidy(crash_text(exit), options, sequence);
  } else if (exit.exit_code != 0 && exit.exit_code != kRunLost) {
    record.status = RunStatus::kFailed;
    record.error = tidy(failure_text(exit), options, sequence);
  } else if (!fs::exists(folder / "metrics.json", code)) {
    record.status = RunStatus::kFailed;
    record.error = "it wrote no metrics.json";
  } else {
    if (exit.exit_code == kRunLost) {
      record.status = RunStatus::kLost;
      record.error = tidy(failure_text(exit), options, sequence);
    }
    if (!sequence.groundtruth) return record;
    const Status written = write_errors(folder, sequence);
    if (!written.ok() && written.error().kind == ErrorKind::kOutput) return written.error();
    if (!written.ok() && record.status == RunStatus::kOk) {
      record.status = RunStatus::kBadTruth;
      record.error = tidy(written.error().message, options, sequence);
    }
  }
  return record;
}

std::string describe_run(const fs::path& folder, const BenchSequence& sequence,
                         const RunRecord& record) {
  std::string text = fmt::format("{} {} {}: ", sequence.name, record.mode, record.run);
  if (record.status != RunStatus::kOk) {
    return text + std::string(name_of(record.status)) + ": " + record.error.value_or("");
  }
  const auto metrics = read_json(folder / "metrics.json");
  if (!metrics.ok()) return text + "ok";
  const double ate_m = number_at(*metrics, "/ate/rmse");
  text += ate_m < 0 ? "no truth" : fmt::format("ATE {:.4f} m", ate_m);
  return text + fmt::format(", {:.1f} % tracked, {:.1f} ms a frame, {:.1f} s",
                            100 * number_at(*metrics, "/coverage"),
                            number_at(*metrics, "/timing_ms/track/median"), record.wall_s);
}

}  // namespace ygslam
