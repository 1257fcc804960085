#include "app/commands.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <cstdio>

#include "app/exit_code.hpp"
#include "app/recording_check.hpp"
#include "app/run_loop.hpp"
#include "app/run_outputs.hpp"
#include "app/run_plan.hpp"
#include "app/run_targets.hpp"
#include "app/stop_signal.hpp"
#include "core/counted.hpp"
#include "io/atomic_file.hpp"

namespace ygslam {
namespace {

Status make_folders(const RunOptions& options) {
  Status writable = ensure_writable_directory(options.out_dir);
  for (const std::string& folder : {options.export_dir, options.background_dir})
    if (!folder.empty() && writable.ok()) writable = ensure_writable_directory(folder);
  return writable;
}

RunFacts facts_of(const RunPlan& plan, const Session& session) {
  RunFacts facts;
  facts.mode = mode_name(plan.settings().dynamic.mode);
  facts.segmenter = session.segmenter;
  facts.precision = session.precision;
  facts.seed = plan.settings().run.seed;
  facts.schedule = plan.schedule();
  return facts;
}

void log_start(const RunPlan& plan, const RunFacts& facts) {
  const Sequence& sequence = plan.sequence;
  log::info("{}: {}, camera from {}, mode {}, segmenter {} {}", plan.options.sequence,
            sequence.stream ? "a stream" : fmt::format("{} pairs", sequence.pairs.size()),
            sequence.camera_source, facts.mode, facts.segmenter, facts.precision);
  const bool is_default = plan.options.segmenter.empty() && plan.options.model.empty();
  if (is_default && facts.segmenter == segmenter_name(kDefaultSegmenter))
    log::info(
        "no network given: people are found by the built-in one; --model FILE knows more "
        "(docs/models.md)");
  for (const std::string& note : sequence.notes) log::info("{}", note);
  warn_about_size(sequence);
  log_shutter(sequence);
  log_registration(sequence);
}

/// Of --trace; what comes after it is in no trace.
Status finish_trace(const RunOptions& options, ActiveRun& run) {
  if (!run.trace) return Ok{};
  if (Status finished = run.trace->finish(); !finished.ok()) return finished;
  std::error_code code;
  if (!std::filesystem::exists(options.trace, code))
    return Error{ErrorKind::kOutput, options.trace + ": was removed during the run"};
  if (const std::uint64_t dropped = run.trace->dropped(); dropped > 0)
    log::warn("{}: {} left out, which came faster than they could be written", options.trace,
              counted(dropped, "event"));
  return Ok{};
}

/// The frames, and what they leave. @return whether there were any.
Result<bool> run_frames(const RunPlan& plan, RunFacts facts, ActiveRun& run, LogFile& log_file) {
  const ScopedTimer wall;
  const Status processed = process_frames(plan, log_file, run);
  const bool has_frames = run.session.runner->finish().statistics.frames > 0;
  facts.wall_s = wall.wall_ms() / 1000;
  if (has_frames)
    if (Status written = write_outputs(plan, facts, run, log_file); !written.ok())
      return written.error();
  if (!processed.ok()) return processed.error();
  const bool draws = !plan.options.background_dir.empty() && has_frames && !run.interrupted_by;
  if (draws)
    if (Status drawn = draw_background(plan, run); !drawn.ok()) return drawn.error();
  if (has_frames)
    if (Status traced = finish_trace(plan.options, run); !traced.ok()) return traced.error();
  if (has_frames) log_file.tell(targets_text(plan.options, plan.settings().dense.enabled, draws));
  return has_frames;
}

void keep_page(ActiveRun& run) {
  run.view->finish(run.session.runner.get());
  log::info("the page stays until it is interrupted (Ctrl-C)");
  std::fflush(stdout);  // what was told is there to be read meanwhile
  run.view->stay([] { return StopSignal::received() != 0; });
}

/// Of a run with frames.
int code_of_run(const RunPlan& plan, const ActiveRun& run) {
  if (run.interrupted_by) return 128 + run.interrupted_by;
  const double lost_share = 1 - coverage(run.session.runner->finish());
  if (lost_share <= plan.settings().run.max_lost_share) return 0;
  const RunStatistics& s = run.session.runner->finish().statistics;
  log::warn("{}: lost for {:.0f} % of the frames{}", plan.options.sequence, 100 * lost_share,
            s.missed == 0 ? ""
                          : fmt::format(" ({} of {} were dropped or could not be read)", s.missed,
                                        s.frames + s.missed));
  return kExitLost;
}

Result<int> run_all(const RunOptions& options) {
  const ScopedTimer startup;
  const auto failed = [](const Error& error) {  // a signal ends the waiting for input, too
    const int signal = StopSignal::received();
    return signal ? Result<int>(128 + signal) : Result<int>(error);
  };
  const auto plan = plan_run(options);
  if (!plan.ok()) return failed(plan.error());
  ActiveRun run;
  if (!options.trace.empty()) run.trace = std::make_unique<TraceWriter>();
  const trace::ScopedTracer traced(run.trace ? run.trace->tracer() : nullptr);
  trace::name_thread("tracking");
  if (Status opened = open_run(*plan, run); !opened.ok()) return failed(opened.error());
  for (const std::string& warning : plan->sequence.warnings) log::warn("{}", warning);
  if (Status made = make_folders(options); !made.ok()) return made.error();
  auto lock = OutputLock::acquire(options.out_dir);
  if (!lock.ok()) return lock.error();
  auto log_file = LogFile::open(std::filesystem::path(options.out_dir) / "log.txt");
  if (!log_file.ok()) return log_file.error();

  RunFacts facts = facts_of(*plan, run.session);
  facts.startup_s = startup.wall_ms() / 1000;
  log_start(*plan, facts);
  const auto has_frames = run_frames(*plan, facts, run, *log_file);
  if (!has_frames.ok()) return has_frames.error();
  if (run.view && options.view.stay) keep_page(run);
  if (!*has_frames) return run.stopped ? 0 : 128 + run.interrupted_by;  // nothing to save
  const int code = code_of_run(*plan, run);
  if (Status written = log_file->finish(); !written.ok()) return written.error();
  return code;
}

void run_and_exit(const RunOptions& options, int& exit_code) {
  StopSignal::watch();
  const NewFolders folders(options);
  exit_code = exit_code_of(run_all(options));
}

}  // namespace
void add_localize_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<RunOptions>();
  options->localize = true;
  CLI::App* command = app.add_subcommand(
      "localize", "Place the frames of a recording in the map of an earlier run");
  declare_localize_options(*command, *options);
  command->callback([options, &exit_code] { run_and_exit(*options, exit_code); });
}

void add_run_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App* command =
      app.add_subcommand("run", "Track the camera through a recording and map what stands still");
  declare_run_options(*command, *options);
  command->callback([options, &exit_code] { run_and_exit(*options, exit_code); });
}

}  // namespace ygslam
