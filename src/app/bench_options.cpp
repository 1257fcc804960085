#include "app/bench_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <regex>
#include <thread>

#include "app/option_checks.hpp"
#include "app/run_options.hpp"
#include "benchmark_runs/python_tool.hpp"
#include "io/text.hpp"
#include "system/metrics.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr const char* kFooter =
    "ROOT is a folder of sequences, or one sequence: TUM RGB-D, Bonn, rendered by `ygslam\n"
    "simulate`, or any folder in TUM layout. Each run is a process of its own, one at a time, the\n"
    "modes taking turns; run N has the seed SEED + N - 1. Stop it whenever you like (Ctrl-C, "
    "kill,\n"
    "power): the same command goes on where it was. What fails (a broken sequence, a truth of\n"
    "another time, a crash, lost tracking, a run over its time) becomes a line on stderr and a\n"
    "marked row; the sweep goes on. The next call makes again what was killed from outside, runs\n"
    "whose files are damaged, and runs that were over their time if it gives more. Runs of modes\n"
    "off and geometry do not depend on --model and --segmenter: other modes with any model may be\n"
    "added to them in the same DIR, but all runs with masks in it are of one model.\n"
    "DIR/report/index.html has tables and figures, docs/evaluation.md the files.\n"
    "Examples:\n"
    "  ygslam bench ~/tum --model yolov8n-seg.onnx        # 5 runs, 4 modes, then the report\n"
    "  ygslam bench SEQ --modes off,geometry --runs 1     # a first look, no network needed\n"
    "  ygslam bench ~/tum --segmenter masks:mask --deterministic --out out/masks\n"
    "  ygslam bench ~/tum --model M.onnx --set motion.tau_px=2 --out out/tau2\n"
    "  ygslam bench ~/tum --modes off --engine dask://head:8786   # on many machines\n"
    "  ygslam bench --compare out/bench out/tau2          # what got better, what got worse\n"
    "Exit codes: 0 all runs were made (however they ended), 2 usage, 3 settings, 4 no sequence "
    "can\n"
    "be used, 5 no model, 9 DIR cannot be written, holds results of another version or of other\n"
    "options, the engine cannot be used, or the report cannot be made (the results stay),\n"
    "129/130/143 interrupted (go on with the same command).";

Status check_model(const BenchArguments& a, SegmenterKind segmenter,
                   const std::vector<std::string>& modes) {
  if (a.model.empty()) {
    if (segmenter != SegmenterKind::kModel || !any_uses_masks(modes)) return Ok{};
    return Error{ErrorKind::kModel,
                 "modes semantic and full need a network: give --model FILE (`make model` exports "
                 "one), or --segmenter masks:DIR, or --modes off,geometry"};
  }
  std::error_code code;  // a slip of the pen is told now, not when a mode needs it
  if (!fs::is_regular_file(a.model, code)) {
    return Error{ErrorKind::kModel, a.model + ": no such model file"};
  }
  return Ok{};
}

// Settings that are not the default, and what else depends on them.
Status read_settings(const BenchArguments& a, SweepOptions& options) {
  RunOptions run;
  run.config_file = a.config_file;
  run.sets = a.sets;
  run.seed = a.seed;
  auto loaded = load_settings(run);
  if (!loaded.ok()) return loaded.error();
  SlamConfig defaults;
  const ConfigSchema set = schema_of(*loaded);
  const ConfigSchema unset = schema_of(defaults);
  for (std::size_t i = 0; i < set.keys().size(); ++i) {
    const ConfigKey& key = set.keys()[i];
    if (key.name == "segment.precision") options.precision = key.get();
    if (key.name == "run.seed" || key.get() == unset.keys()[i].get()) continue;
    if (key.name == "dynamic.mode") {
      return Error{ErrorKind::kConfig, "dynamic.mode: a sweep takes the modes from --modes"};
    }
    options.config[key.name] = key.get();
  }
  options.seed = loaded->run.seed;
  return Ok{};
}

bool is_engine(const std::string& text) {
  static const std::regex form("dask://([A-Za-z0-9._-]+|\\[[0-9A-Fa-f:.]+\\]):[0-9]{1,5}");
  return std::regex_match(text, form);
}

std::string machine_name() {
  return processor_name() + ", " + std::to_string(std::thread::hardware_concurrency()) + " threads";
}

}  // namespace

void declare_bench_options(CLI::App& command, BenchArguments& a) {
  CLI::Option* root = command.add_option("ROOT", a.root, "Folder of sequences, or one sequence");
  command.add_option("--out", a.out, "Folder for the results")
      ->type_name("DIR")
      ->capture_default_str();
  command.add_option("--sequences", a.sequences, "Only these, by name")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("A,B");
  command.add_option("--modes", a.modes, "What is done about moving things (default: all four)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(std::vector<std::string>(kSweepModes.begin(), kSweepModes.end())))
      ->type_name("LIST");
  command.add_option("--runs", a.runs, "Runs of each sequence in each mode")
      ->check(in_range(1, kMostRuns))
      ->type_name("N")
      ->capture_default_str();
  command
      .add_option(
          "--jobs", a.jobs,
          "Runs at the same time; more than 1 spoils the timings (default: 1; with --engine "
          "as many as its workers have threads)")
      ->check(in_range(1, 1024))
      ->type_name("N");
  command
      .add_option(
          "--engine", a.engine,
          "Send the runs to the workers of a Dask scheduler, which see the same files at the "
          "same places")
      ->check(CLI::Validator(
          [](std::string& text) {
            return is_engine(text) ? "" : text + ": must be dask://HOST:PORT";
          },
          ""))
      ->type_name("dask://HOST:PORT");
  command
      .add_option("--run-limit", a.run_limit_s,
                  "Longest time of a run [s], then it is ended and counts as timed out; 0: none "
                  "(default: 600 s + 30 times the sequence's duration)")
      ->check(in_range(0.0, 1e9))
      ->type_name("S");
  command
      .add_option("--model", a.model,
                  "Segmentation network, .onnx or .xml; only modes semantic and full use it, but "
                  "a file that is named must be there")
      ->type_name("FILE");
  command
      .add_option("--segmenter", a.segmenter,
                  std::string(kSegmenterHelp) + "; a relative DIR lies inside each sequence")
      ->type_name(kSegmenterType)
      ->default_str(segmenter_name(kDefaultSegmenter));
  command.add_option("--config", a.config_file, "Settings (see `ygslam config`)")
      ->type_name("FILE.yaml");
  command.add_option("--set", a.sets, "One setting; may be repeated")
      ->allow_extra_args(false)
      ->type_name("KEY=VALUE");
  CLI::Option* realtime =
      command.add_flag("--realtime", a.realtime, "Feed frames at their stamps, drop when late");
  command.add_flag("--deterministic", a.deterministic, "One schedule: same input, same bytes")
      ->excludes(realtime);
  command.add_option("--seed", a.seed, "Of the first run")
      ->check(in_range(std::uint64_t{0}, std::uint64_t{1} << 53U))
      ->type_name("N");
  command.add_flag(
      "--pictures,!--no-pictures", a.pictures,
      "Tracking pictures for the report: `ygslam inspect` on every sequence (default)");
  command.add_flag("--report,!--no-report", a.report, "Make the report at the end (default)");
  command
      .add_option("--compare", a.compare, "Instead of a sweep: two results folders, B against A")
      ->expected(2)
      ->excludes(root)
      ->type_name("A B");
  command.add_flag("--json", a.json, "Results or comparison as JSON on stdout");
  command.footer(kFooter);
}

Result<SweepOptions> sweep_options(const BenchArguments& a) {
  SweepOptions options;
  options.modes = a.modes;
  if (options.modes.empty()) options.modes.assign(kSweepModes.begin(), kSweepModes.end());
  std::vector<std::string> unique;
  for (const std::string& mode : options.modes) {
    if (std::find(unique.begin(), unique.end(), mode) == unique.end()) unique.push_back(mode);
  }
  options.modes = unique;
  options.run_limit_s = a.run_limit_s;
  if (a.run_limit_s && !std::isfinite(*a.run_limit_s)) {
    return Error{ErrorKind::kUsage, "--run-limit: must be a finite number"};
  }
  SessionOptions session;
  const Status chosen = choose_segmenter(a.segmenter, a.model, session);
  for (const Status& step :
       {chosen, read_settings(a, options), check_model(a, session.segmenter, options.modes)}) {
    if (!step.ok()) return step.error();
  }
  std::error_code code;
  options.root = a.root;
  options.out = fs::absolute(a.out, code).lexically_normal();
  if (!options.out.has_filename()) options.out = options.out.parent_path();
  options.sequences = a.sequences;
  options.runs = a.runs;
  if (!a.engine.empty()) options.engine = a.engine.substr(std::string_view("dask://").size());
  options.jobs = a.jobs.value_or(options.engine.empty() ? 1 : 0);
  options.schedule = a.deterministic ? Schedule::kDeterministic
                     : a.realtime    ? Schedule::kRealtime
                                     : Schedule::kFile;
  options.segmenter = a.segmenter.empty() ? segmenter_name(session.segmenter) : a.segmenter;
  const bool is_model = session.segmenter == SegmenterKind::kModel && !a.model.empty();
  if (is_model) options.model = fs::absolute(a.model, code);
  if (!is_model && session.segmenter != SegmenterKind::kBuiltin) options.precision.clear();
  options.version = version();
  options.machine = machine_name();
  options.program = executable_path();
  return options;
}

}  // namespace ygslam
