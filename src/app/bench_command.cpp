#include "app/commands.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <optional>

#include "app/bench_options.hpp"
#include "app/exit_code.hpp"
#include "app/program_log.hpp"
#include "app/progress_bar.hpp"
#include "app/run_targets.hpp"
#include "app/standard_streams.hpp"
#include "app/stop_signal.hpp"
#include "benchmark_runs/child_process.hpp"
#include "benchmark_runs/compare.hpp"
#include "benchmark_runs/pictures.hpp"
#include "benchmark_runs/python_tool.hpp"
#include "benchmark_runs/sweep.hpp"
#include "core/time.hpp"

namespace ygslam {
namespace {

constexpr double kChecksOfPictures = 3;  // each takes as long as a run

// Names come from the file system and may be any bytes; JSON needs UTF-8.
void print(const nlohmann::ordered_json& json) {
  print_text(json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

Result<int> compare_results(const BenchArguments& a) {
  const auto before = read_results(a.compare[0]);
  if (!before.ok()) return before.error();
  const auto after = read_results(a.compare[1]);
  if (!after.ok()) return after.error();
  const Comparison comparison = compare(*before, *after);
  if (comparison.rows.empty()) log::warn("the two have no sequence and mode in common");
  if (a.json) {
    print(to_json(comparison));
  } else {
    print_text(format_comparison(comparison));
  }
  return 0;
}

// Lines go above the progress bar.
class SweepDisplay {
 public:
  explicit SweepDisplay(bool quiet) : quiet_(quiet) {}
  [[nodiscard]] SweepObserver observer() {
    return {[this](const std::string& line) { say(line, false); },
            [this](const std::string& line) { say(line, true); },
            [this](std::size_t done, std::size_t total, const std::string& now) {
              show(done, total, now);
            },
            [] { return StopSignal::received() != 0; }};
  }
  void end() { bar_.reset(); }

 private:
  void say(const std::string& line, bool fault) {
    if (bar_) bar_->clear();
    log::write(fault ? log::Level::kWarning : log::Level::kInfo, line);
  }
  void show(std::size_t done, std::size_t total, const std::string& now) {
    if (!bar_) {
      bar_ = std::make_unique<ProgressBar>(total, quiet_);
      done_before_ = done;
    }
    bar_->update(done, now + time_left(done, total));
  }
  // From the runs made so far; nothing before the first.
  [[nodiscard]] std::string time_left(std::size_t done, std::size_t total) const {
    if (done <= done_before_ || done >= total) return "";
    const double a_run_s = clock_.wall_ms() * 1e-3 / static_cast<double>(done - done_before_);
    const double left_min = a_run_s * static_cast<double>(total - done) / 60;
    return left_min < 1 ? ", under a minute left"
                        : fmt::format(", about {:.0f} min left", left_min);
  }

  bool quiet_;
  std::unique_ptr<ProgressBar> bar_;
  std::size_t done_before_ = 0;
  ScopedTimer clock_;
};

Status print_results(const std::filesystem::path& out, bool json) {
  const auto results = read_results(out);
  if (!results.ok()) return results.error();
  if (json) {
    print(to_json(*results));
  } else if (!is_quiet()) {
    print_text(format_results(*results));
  }
  return Ok{};
}

// A sequence whose pictures fail keeps its rows.
void draw_pictures(const SweepOptions& options, const std::vector<BenchSequence>& sequences) {
  ProgressBar bar(sequences.size(), is_quiet());
  for (std::size_t i = 0; i < sequences.size() && StopSignal::received() == 0; ++i) {
    const BenchSequence& sequence = sequences[i];
    if (sequence.error || has_pictures(options, sequence)) continue;
    bar.update(i, "tracking pictures of " + sequence.name);
    const double limit_s = kChecksOfPictures * run_limit_s(options, sequence);
    const ScopedTimer clock;
    const auto is_late = [&] { return limit_s > 0 && clock.wall_ms() * 1e-3 > limit_s; };
    const auto drawn = run_child(inspect_command(options, sequence), {},
                                 [&] { return StopSignal::received() != 0 || is_late(); });
    if (StopSignal::received() != 0) return;
    std::optional<std::string> fault;
    if (!drawn.ok()) {
      fault = drawn.error().message;
    } else if (is_late() && drawn->exit_code + drawn->signal != 0) {
      fault = fmt::format("timed out after {:g} s (--run-limit)", limit_s);
    } else if (drawn->exit_code + drawn->signal != 0) {
      fault = last_error_line(drawn->errors);
    } else if (const Status marked = mark_pictures(options, sequence); !marked.ok()) {
      fault = marked.error().message;
    }
    if (!fault) continue;
    bar.clear();
    log::warn("{}: no tracking pictures: {}", sequence.name, *fault);
  }
}

/// Whether the report's program and its packages are there: asked before the first run.
Status can_make_report() {
  const auto tool = find_report_tool(executable_path());
  const Status checked = tool.ok() ? run_tool(*tool, {"--check"}, "the report") : tool.error();
  if (checked.ok()) return Ok{};
  return Error{ErrorKind::kOutput,
               checked.error().message + "; nothing was run (--no-report does without)"};
}

Status make_report(const std::filesystem::path& out) {
  auto tool = find_report_tool(executable_path());
  Status made =
      tool.ok()
          ? run_tool(*tool, {"--results=" + out.string()}, "the report", {},
                     [] { return StopSignal::received() != 0; })
          : Status(Error{tool.error().kind, "the report cannot be made: " + tool.error().message});
  if (!made.ok()) {
    return Error{ErrorKind::kOutput,
                 made.error().message + "; the results stay in " + out.string()};
  }
  log::info("report: {}", (out / "report" / "index.html").string());
  return Ok{};
}

// Everything that log.txt tells of.
Result<int> make_runs(const BenchArguments& a, const SweepOptions& options, Sweep& sweep,
                      SweepDisplay& display, LogFile& log_file) {
  const std::filesystem::path& out = options.out;
  log::info("{} sequences, {} runs, {} of them done before", sweep.sequences().size(),
            sweep.total(), sweep.done_before());
  sweep.tell_faults();
  if (!sweep.has_usable_sequence()) {
    return Error{ErrorKind::kInput, a.root + ": none of its sequences can be used"};
  }
  if (a.report) {
    const Status possible = can_make_report();
    if (!possible.ok()) return possible.error();
  }
  if (Status placed = log_file.place(); !placed.ok()) return placed.error();
  const auto complete = sweep.run();
  display.end();
  if (!complete.ok()) return complete.error();
  if (!*complete) {
    log::warn("interrupted; the same command goes on where it was");
    return 128 + StopSignal::received();
  }
  if (sweep.to_try_again() > 0) {
    log::warn("{} runs were killed from outside; the same command tries them again",
              sweep.to_try_again());
  }
  const Status printed = print_results(out, a.json);
  if (!printed.ok()) return printed.error();
  if (!a.report) return 0;
  if (a.pictures) draw_pictures(options, sweep.sequences());
  const Status made = make_report(out);
  if (StopSignal::received() != 0) return 128 + StopSignal::received();
  if (!made.ok()) return made.error();
  return 0;
}

Result<int> run_sweep(const BenchArguments& a) {
  if (a.root.empty()) return Error{ErrorKind::kUsage, "ROOT is required (see --help)"};
  const auto found = find_sequences(a.root);  // before anybody is sent for a model
  if (!found.ok()) return found.error();
  const auto options = sweep_options(a);
  if (!options.ok()) return options.error();
  const std::filesystem::path out = options->out;
  const NewFolders folders({out.string()});
  SweepDisplay display(is_quiet());
  auto sweep = Sweep::open(*options, display.observer());
  if (StopSignal::received() != 0) return 128 + StopSignal::received();
  if (!sweep.ok()) return sweep.error();
  auto log_file = LogFile::open(out / "log.txt", true);
  if (!log_file.ok()) return log_file.error();
  auto code = make_runs(a, *options, *sweep, display, *log_file);
  if (code.ok()) return code;
  log::error("{}", code.error().message);  // while the log is open
  return static_cast<int>(code.error().kind);
}

}  // namespace

void add_bench_command(CLI::App& app, int& exit_code) {
  const auto arguments = std::make_shared<BenchArguments>();
  CLI::App* command = app.add_subcommand(
      "bench", "The paper's experiments: every sequence, every mode, several runs, a report");
  declare_bench_options(*command, *arguments);
  command->callback([arguments, &exit_code] {
    StopSignal::watch();
    exit_code = exit_code_of(arguments->compare.empty() ? run_sweep(*arguments)
                                                        : compare_results(*arguments));
  });
}

}  // namespace ygslam
