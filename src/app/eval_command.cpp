#include "app/eval_command.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/log.hpp"
#include "eval/report.hpp"

namespace ygslam {
namespace {

struct EvalArguments {
  std::string truth;
  std::vector<std::string> estimates;
  std::string align = "se3";
  double max_diff_s = EvalOptions{}.max_diff_s;
  std::string frames;
  bool json = false;
};

// Names come from the file system and may be any bytes; JSON needs UTF-8.
std::string dump(const nlohmann::json& json) {
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

Result<EvalReport> evaluate_file(const std::string& path, const std::vector<StampedPose>& truth,
                                 const std::vector<Timestamp>& frames, const EvalOptions& options) {
  const auto estimate = read_tum_trajectory(path);
  if (!estimate.ok()) return estimate.error();
  auto report = evaluate(truth, *estimate, options, frames);
  if (!report.ok()) return Error{report.error().kind, path + ": " + report.error().message};
  return report;
}

Result<std::string> run_eval(const EvalArguments& arguments) {
  if (!std::isfinite(arguments.max_diff_s)) {
    return Error{ErrorKind::kUsage, "--max-diff: must be a finite number"};
  }
  EvalOptions options;
  options.align = *parse_align_mode(arguments.align);
  options.max_diff_s = arguments.max_diff_s;
  const auto truth = read_tum_trajectory(arguments.truth);
  if (!truth.ok()) return truth.error();
  std::vector<Timestamp> frames;
  if (!arguments.frames.empty()) {
    auto read = read_frame_stamps(arguments.frames);
    if (!read.ok()) return read.error();
    frames = std::move(*read);
  }
  nlohmann::json list = nlohmann::json::array();
  std::string table;
  for (const std::string& path : arguments.estimates) {
    const auto report = evaluate_file(path, *truth, frames, options);
    if (!report.ok()) return report.error();
    for (const std::string& warning : report->warnings) {
      if (arguments.json) log::warn("{}: {}", path, warning);  // the table shows them itself
    }
    list.push_back(to_json(*report));
    list.back()["estimate"] = path;
    table += format_report(*report, path);
  }
  if (!arguments.json) return table;
  return dump(list.size() == 1 ? list.front() : nlohmann::json{{"estimates", list}}) + "\n";
}

}  // namespace

void add_eval_command(CLI::App& app, int& exit_code) {
  const auto arguments = std::make_shared<EvalArguments>();
  CLI::App* command = app.add_subcommand(
      "eval", "Absolute and relative trajectory errors (ATE, RPE) against ground truth");
  command->add_option("--gt", arguments->truth, "True trajectory, TUM format")
      ->required()
      ->type_name("FILE");
  command->add_option("--est", arguments->estimates, "Estimated trajectories, TUM format")
      ->required()
      ->type_name("FILE...");
  command
      ->add_option("--align", arguments->align,
                   "se3: least squares; sim3: with scale; first: first poses coincide; none")
      ->check(CLI::IsMember({"se3", "sim3", "first", "none"}))
      ->type_name("MODE")
      ->capture_default_str();
  command
      ->add_option("--max-diff", arguments->max_diff_s, "Largest difference of matched stamps [s]")
      ->check(CLI::Range(0.0, 1e6))
      ->type_name("S")
      ->capture_default_str();
  command
      ->add_option("--frames", arguments->frames,
                   "All frames (associations.txt, rgb.txt or frames.csv): adds the coverage")
      ->type_name("FILE");
  command->add_flag("--json", arguments->json, "JSON instead of a table");
  command->footer(
      "Errors are told in metres and degrees, RPE over 30 frames and over 1 s, all pairs.\n"
      "Example:\n"
      "  ygslam eval --gt SEQUENCE/groundtruth.txt --est out/trajectory.txt --json\n"
      "Exit codes: 0 ok, 2 usage, 4 a file that cannot be used or no common time.");
  command->callback([arguments, &exit_code] {
    const auto text = run_eval(*arguments);
    if (text.ok()) {
      std::fputs(text->c_str(), stdout);
      return;
    }
    log::error("{}", text.error().message);
    exit_code = static_cast<int>(text.error().kind);
  });
}

}  // namespace ygslam
