#include "benchmark_runs/judge_run.hpp"

#include <cstring>

#include "benchmark_runs/run_files.hpp"
#include "core/log.hpp"  // brings {fmt}
#include "eval/report.hpp"
#include "io/atomic_file.hpp"
#include "io/trajectory_formats.hpp"

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

std::string crash_text(int signal, const std::string& errors) {
  const std::string said = last_error_line(errors);
  return "ended by " + signal_name(signal) + (said.empty() ? "" : "; last said: " + said);
}

std::string failure_text(const ChildExit& exit) {
  const std::string said = last_error_line(exit.errors);
  return said.empty() ? "exit code " + std::to_string(exit.exit_code) : said;
}

// How a run ended, before the truth is asked.
struct RunEnd {
  RunStatus status = RunStatus::kOk;
  int signal = 0;
  std::string error;
};

// A run that is asked to end saves what it has and says so by its exit code.
int signal_of(const ChildExit& exit) {
  constexpr int kSignalBase = 128;
  const int told = exit.exit_code - kSignalBase;
  return exit.signal == 0 && told > 0 && comes_from_outside(told) ? told : exit.signal;
}

RunEnd end_of(const ChildExit& exit, const fs::path& folder) {
  const int signal = signal_of(exit);
  if (exit.timed_out) {
    return {RunStatus::kTimedOut, exit.signal,
            fmt::format("not done after {:g} s (--run-limit)", exit.limit_s)};
  }
  if (signal != 0) return {RunStatus::kCrashed, signal, crash_text(signal, exit.errors)};
  if (exit.exit_code != 0 && exit.exit_code != kExitLost) {
    return {RunStatus::kFailed, 0, failure_text(exit)};
  }
  std::error_code code;
  if (!fs::exists(folder / "metrics.json", code)) {
    return {RunStatus::kFailed, 0, "it wrote no metrics.json"};
  }
  const auto metrics = read_metrics(folder / "metrics.json");
  if (!metrics.ok()) return {RunStatus::kFailed, 0, metrics.error().message};
  if (exit.exit_code == kExitLost) return {RunStatus::kLost, 0, failure_text(exit)};
  const auto trajectory = read_tum_trajectory(folder / "trajectory.txt");
  if (!trajectory.ok()) return {RunStatus::kFailed, 0, trajectory.error().message};
  return {};
}

// Errors of the trajectory against the truth, as a file.
Status write_errors(const fs::path& folder, const BenchSequence& sequence) {
  const auto truth = read_stamped_trajectory(*sequence.groundtruth);
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

}  // namespace

Result<RunRecord> judge_run(const SweepOptions& options, const BenchSequence& sequence,
                            const RunKey& key, const ChildExit& exit) {
  RunRecord record;
  record.exit_code = exit.exit_code;
  record.command = shown_command(options, sequence, key);
  record.mode = key.mode;
  record.run = key.run;
  record.seed = seed_of(options, key);
  record.wall_s = exit.wall_s;
  record.timings_valid = options.jobs == 1;
  record.version = options.version;
  record.sequence_fingerprint = sequence.fingerprint;
  if (mode_uses_masks(key.mode)) record.masks_fingerprint = sequence.masks_fingerprint;
  record.limit_s = exit.limit_s;
  const fs::path folder = options.out / key.folder();
  RunEnd end = end_of(exit, folder);
  record.status = end.status;
  record.signal = end.signal;
  if (has_figures(record.status) && sequence.groundtruth) {
    const Status written = write_errors(folder, sequence);
    if (!written.ok() && written.error().kind == ErrorKind::kOutput) return written.error();
    if (!written.ok() && record.status == RunStatus::kOk) {
      record.status = RunStatus::kBadTruth;
      end.error = written.error().message;
    }
  }
  if (record.status != RunStatus::kOk) record.error = tidy(end.error, options, sequence);
  if (has_figures(record.status)) record.files = fingerprints_of(folder);
  return record;
}

std::string describe_run(const fs::path& folder, const BenchSequence& sequence,
                         const RunRecord& record) {
  std::string text = fmt::format("{} {} {}: ", sequence.name, record.mode, record.run);
  if (record.status != RunStatus::kOk) {
    return text + std::string(name_of(record.status)) + ": " + record.error.value_or("");
  }
  const auto metrics = read_metrics(folder / "metrics.json");
  if (!metrics.ok()) return text + "ok";
  const double ate_m = number_at(*metrics, "/ate/rmse").value_or(-1);
  text += ate_m < 0 ? "no truth" : fmt::format("ATE {:.4f} m", ate_m);
  return text + fmt::format(", {:.1f} % tracked, {:.1f} ms a frame, {:.1f} s",
                            100 * number_at(*metrics, "/coverage").value_or(-1),
                            number_at(*metrics, "/timing_ms/track/median").value_or(-1),
                            record.wall_s);
}

}  // namespace ygslam
