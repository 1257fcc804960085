#include "app/commands.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/eval_map.hpp"
#include "app/eval_plot.hpp"
#include "app/file_uses.hpp"
#include "app/option_checks.hpp"
#include "app/program_log.hpp"
#include "app/standard_streams.hpp"
#include "bag/bag_trajectory.hpp"
#include "core/log.hpp"
#include "eval/mot_text.hpp"
#include "eval/report.hpp"
#include "eval/tracking_report.hpp"
#include "io/atomic_file.hpp"
#include "io/trajectory_formats.hpp"

namespace ygslam {
namespace {

struct EvalArguments {
  std::string truth;
  std::vector<std::string> estimates;
  std::string format = "auto", stamps = "auto", align = "se3";
  double max_diff_s = EvalOptions{}.max_diff_s, offset_s = 0;
  std::string frames, times, plot, errors, truth_topic, estimate_topic;
  std::string map, surface;
  bool tracks = false, json = false, same_body = false, mirrored_truth = false;
};

// One estimate and what came out.
struct Judged {
  std::string path;
  Evaluation evaluation;
};

struct Inputs {
  EvalOptions options;
  std::vector<StampedPose> truth;
  bool truth_has_stamps = true;
  bool uses_times = false;  ///< some trajectory took its stamps from --times
  std::vector<Timestamp> frames;
};

// Names come from the file system and may be any bytes; JSON needs UTF-8.
std::string dump(const nlohmann::json& json) {
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

Error usage(const std::string& what) { return {ErrorKind::kUsage, what}; }

Status check(const EvalArguments& a) {
  if (!std::isfinite(a.max_diff_s)) return usage("--max-diff: must be a finite number");
  if (!std::isfinite(a.offset_s)) return usage("--offset: must be a finite number");
  if (!a.plot.empty() && !is_plot_file(a.plot)) {
    return usage("--plot " + a.plot + ": the name must end in .svg, .png or .pdf");
  }
  return Ok{};
}

/// A topic of poses in a bag, and the option that names it.
struct TopicChoice {
  const std::string& topic;
  const char* option;
};

Result<TrajectoryFile> read(const std::string& path, const TopicChoice& choice,
                            const EvalArguments& a, bool& uses_times) {
  const bool is_of_bag = is_bag(path);
  if (!is_of_bag && !choice.topic.empty())
    return usage(std::string(choice.option) + ": " + path + " is no bag");
  // Nothing for auto.
  auto file =
      is_of_bag
          ? read_bag_trajectory(path, choice.topic, choice.option)
          : read_trajectory(path, {parse_trajectory_format(a.format), parse_stamp_unit(a.stamps)});
  if (file.ok()) log_detail(fmt::format("{}: {} poses", path, file->poses.size()));
  if (!file.ok() || file->has_stamps || a.times.empty()) return file;
  uses_times = true;
  Status stamped = add_stamps(a.times, path, *file);
  if (!stamped.ok()) return stamped.error();
  return file;
}

Result<Inputs> read_inputs(const EvalArguments& a) {
  Inputs inputs;
  inputs.options.align = *parse_align_mode(a.align);
  inputs.options.max_diff_s = a.max_diff_s;
  inputs.options.same_body = a.same_body;
  inputs.options.mirrored_truth = a.mirrored_truth;
  auto truth = read(a.truth, {a.truth_topic, "--gt-topic"}, a, inputs.uses_times);
  if (!truth.ok()) return truth.error();
  inputs.truth = std::move(truth->poses);
  inputs.truth_has_stamps = truth->has_stamps;
  inputs.options.w_first.truth = truth->reads_w_first;
  if (!truth->has_stamps) {  // pose n belongs to pose n
    inputs.options.has_stamps = false;
    inputs.options.max_diff_s = 0;
    if (a.offset_s != 0) return usage("--offset: " + a.truth + " has no stamps");
    if (!a.frames.empty()) return usage("--frames: " + a.truth + " has no stamps");
  }
  if (!a.frames.empty()) {
    auto frames = read_frame_stamps(a.frames);
    if (!frames.ok()) return frames.error();
    inputs.frames = std::move(*frames);
  }
  return inputs;
}

// Poses without stamps belong together by their lines: there must be equally many.
Status check_lines(const Inputs& inputs, const TrajectoryFile& estimate, const EvalArguments& a,
                   const std::string& path) {
  if (estimate.has_stamps != inputs.truth_has_stamps) {
    return Error{ErrorKind::kInput, (estimate.has_stamps ? a.truth : path) +
                                        ": has no stamps and the other trajectory has: give them "
                                        "with --times FILE"};
  }
  if (!estimate.has_stamps && estimate.poses.size() != inputs.truth.size()) {
    return Error{ErrorKind::kInput, path + ": " + std::to_string(estimate.poses.size()) +
                                        " poses, the truth has " +
                                        std::to_string(inputs.truth.size()) +
                                        ": without stamps they belong together by line"};
  }
  return Ok{};
}

Result<Evaluation> judge(const std::string& path, Inputs& inputs, const EvalArguments& a) {
  auto estimate = read(path, {a.estimate_topic, "--est-topic"}, a, inputs.uses_times);
  if (!estimate.ok()) return estimate.error();
  const Status matching = check_lines(inputs, *estimate, a, path);
  if (!matching.ok()) return matching.error();
  inputs.options.w_first.estimate = estimate->reads_w_first;
  for (StampedPose& pose : estimate->poses) pose.stamp.ns += to_ns(a.offset_s);
  auto evaluation =
      evaluate_in_detail(inputs.truth, estimate->poses, inputs.options, inputs.frames);
  if (!evaluation.ok()) {
    return Error{evaluation.error().kind, path + ": " + evaluation.error().message};
  }
  return evaluation;
}

Status write_errors(const std::string& file, const std::vector<Judged>& judged) {
  if (judged.size() == 1) {
    return write_file_atomically(file, errors_csv(judged.front().evaluation.series));
  }
  std::string text = std::string("estimate,") + kErrorColumns + "\n";
  for (const Judged& one : judged) {
    std::string name = one.path;  // quoted as RFC 4180 has it
    for (std::size_t i = 0; (i = name.find('"', i)) != std::string::npos; i += 2)
      name.insert(i, "\"");
    text += error_rows(one.evaluation.series, "\"" + name + "\",");
  }
  return write_file_atomically(file, text);
}

// What was read must not be written over.
Status check_outputs(const EvalArguments& a) {
  FileUses uses;
  for (const std::string& estimate : a.estimates) uses.reads("--est", estimate);
  uses.reads("--gt", a.truth);
  uses.reads("--frames", a.frames);
  uses.reads("--times", a.times);
  uses.writes("--errors", a.errors);
  uses.writes("--plot", a.plot);
  return uses.check();
}

Status write_files(const EvalArguments& a, const Inputs& inputs,
                   const std::vector<Judged>& judged) {
  if (!a.errors.empty()) {
    Status written = write_errors(a.errors, judged);
    if (!written.ok()) return written;
  }
  if (a.plot.empty()) return Ok{};
  std::vector<PlottedEstimate> plotted;
  for (const Judged& one : judged) plotted.push_back({one.path, &one.evaluation});
  return write_plot(a.plot, inputs.truth, plotted);
}

std::string as_json(const std::vector<Judged>& judged) {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& [path, evaluation] : judged) {
    for (const std::string& warning : evaluation.report.warnings)
      log::warn("{}: {}", path, warning);
    list.push_back(to_json(evaluation.report));
    list.back()["estimate"] = path;
  }
  return dump(list.size() == 1 ? list.front() : nlohmann::json{{"estimates", list}}) + "\n";
}

std::string as_table(const std::vector<Judged>& judged) {
  if (judged.size() == 1) {
    return format_report(judged.front().evaluation.report, one_line(judged.front().path));
  }
  std::vector<NamedReport> reports;
  for (const Judged& one : judged) reports.push_back({one_line(one.path), one.evaluation.report});
  return format_comparison(reports);
}

/// Tracks of things in place of trajectories of cameras.
Result<std::string> run_tracks(const EvalArguments& a) {
  if (a.estimates.size() != 1) return usage("--tracks: takes one --est");
  const auto boxes = read_mot(a.truth, a.estimates.front());
  if (!boxes.ok()) return boxes.error();
  std::vector<SimilarityFrame> frames;
  for (const BoxFrame& frame : *boxes) frames.push_back(compare(frame));
  const TrackingScore score = score_tracking(frames);
  return a.json ? to_json(score).dump(2) + "\n" : format_tracking(score);
}

/// A map's surface in place of a trajectory.
Result<std::string> run_map(const EvalArguments& a) {
  if (a.surface.empty()) return usage("--map: needs --truth, the true surface");
  if (a.estimates.size() > 1) return usage("--map: takes one --est");
  const std::string trajectory = a.estimates.empty() ? "" : a.estimates.front();
  return eval_map({a.map, a.surface, trajectory, a.truth, a.max_diff_s, a.json});
}

Result<std::string> run_eval(const EvalArguments& a) {
  if (!a.map.empty()) return run_map(a);
  if (a.truth.empty()) throw CLI::RequiredError("--gt");
  if (a.estimates.empty()) throw CLI::RequiredError("--est");
  if (a.tracks) return run_tracks(a);
  const Status checked = check(a);
  if (!checked.ok()) return checked.error();
  const Status outputs = check_outputs(a);
  if (!outputs.ok()) return outputs.error();
  auto inputs = read_inputs(a);
  if (!inputs.ok()) return inputs.error();
  std::vector<Judged> judged;
  for (const std::string& path : a.estimates) {
    auto evaluation = judge(path, *inputs, a);
    if (!evaluation.ok()) return evaluation.error();
    judged.push_back({path, std::move(*evaluation)});
  }
  if (!a.times.empty() && !inputs->uses_times)
    return usage("--times " + a.times + ": all of these trajectories have stamps of their own");
  const Status written = write_files(a, *inputs, judged);
  if (!written.ok()) return written.error();
  return a.json ? as_json(judged) : as_table(judged);
}

/// JSON stays alone on standard output.
void tell_files(const EvalArguments& a) {
  if (a.tracks || !a.map.empty()) return;  // these write none
  for (const std::string& file : {a.errors, a.plot}) {
    if (file.empty()) continue;
    if (a.json) {
      log::info("written: {}", file);
    } else {
      tell_written(file);
    }
  }
}

void declare_options(CLI::App& command, EvalArguments& a) {
  command.add_option("--gt", a.truth, "True trajectory: a file, a bag, or a folder of poses")
      ->type_name("PATH");
  command.add_option("--est", a.estimates, "Estimated trajectories; several are compared")
      ->type_name("PATH...");
  command
      .add_option("--gt-topic", a.truth_topic,
                  "Of --gt as a bag: the topic with its poses, or /tf:CHILD (the only one)")
      ->type_name("TOPIC");
  command.add_option("--est-topic", a.estimate_topic, "Of --est as bags: the same")
      ->type_name("TOPIC");
  command
      .add_option("--format", a.format,
                  "Of all trajectories: tum, kitti (3x4 matrices), euroc (CSV, nanoseconds); "
                  "auto: each by its content (docs/inputs.md)")
      ->check(CLI::IsMember({"auto", "tum", "kitti", "euroc"}))
      ->type_name("NAME")
      ->capture_default_str();
  command
      .add_option("--stamps", a.stamps,
                  "Unit of the stamps in all trajectories; auto: by header or size")
      ->check(CLI::IsMember({"auto", "s", "ms", "us", "ns"}))
      ->type_name("UNIT")
      ->capture_default_str();
  command.add_option("--times", a.times, "Stamps for poses without, one a line [s]")
      ->type_name("FILE");
  command
      .add_option("--align", a.align,
                  "se3: least squares; sim3: with scale; first: first poses coincide; none")
      ->check(CLI::IsMember({"se3", "sim3", "first", "none"}))
      ->type_name("MODE")
      ->capture_default_str();
  command.add_flag("--same-body", a.same_body,
                   "Truth and estimate are of one body: look for no constant turn and offset");
  command.add_flag("--mirrored-truth", a.mirrored_truth,
                   "The truth is of a camera with y up, as ICL-NUIM's (fy < 0)");
  command.add_option("--max-diff", a.max_diff_s, "Largest difference of matched stamps [s]")
      ->check(in_range(0.0, 1e6))
      ->type_name("S")
      ->capture_default_str();
  command.add_option("--offset", a.offset_s, "Added to the stamps of the estimates [s]")
      ->check(in_range(-1e6, 1e6))
      ->type_name("S")
      ->capture_default_str();
  command
      .add_option("--frames", a.frames,
                  "All frames (associations.txt, rgb.txt or frames.csv): adds the coverage")
      ->type_name("FILE");
  command.add_option("--errors", a.errors, "Write the errors of every pose")->type_name("FILE.csv");
  command.add_option("--plot", a.plot, "Draw the paths and the errors over time")
      ->type_name("FILE.svg|png|pdf");
  CLI::Option* tracks =
      command.add_flag("--tracks", a.tracks,
                       "The files are tracks of things (MOTChallenge text): HOTA, IDF1, CLEAR MOT");
  CLI::Option* map =
      command
          .add_option("--map", a.map,
                      "Judge a surface: mesh.ply, cloud.ply or the folder it lies in (see below)")
          ->excludes(tracks)
          ->type_name("FILE|DIR");
  for (const char* of_trajectories :
       {"--format", "--stamps", "--times", "--align", "--offset", "--frames", "--errors", "--plot",
        "--same-body", "--mirrored-truth", "--gt-topic", "--est-topic"}) {
    map->excludes(of_trajectories);
    tracks->excludes(of_trajectories);
  }
  tracks->excludes("--max-diff");
  command
      .add_option("--truth", a.surface,
                  "Of --map: a folder that `simulate --truth` wrote, or a PLY file of the surface")
      ->needs("--map")
      ->type_name("DIR|FILE");
  command.add_flag("--json", a.json, "JSON instead of a table");
}

constexpr const char* kEvalFooter =
    "Each stamp of the shorter trajectory takes its nearest in the other one. ATE over all "
    "matched\n"
    "poses; RPE over 30 frames and over 1 s, all pairs. Without stamps (matrices without "
    "--times)\n"
    "the n-th pose belongs to the n-th. Where the truth is of another body than the camera (a\n"
    "marker), the constant turn and offset are found, told, and taken out of RPE and rotation "
    "errors.\n"
    "A map lies in the frame of its run: --est takes that run's trajectory, whose mean pose "
    "against\n"
    "--gt (else groundtruth.txt in the folder of --truth) lays the map over the truth. Without "
    "--est\n"
    "it lies there already. Told are the distance of the map to the true surface (accuracy), the\n"
    "share within 5 cm of it (precision), how much of what was seen the map has (completeness), "
    "and,\n"
    "where --truth is a folder, the share left where movers were (ghosts) and, where both tell of\n"
    "things, which were found.\n"
    "Examples:\n"
    "  ygslam eval --gt SEQUENCE/groundtruth.txt --est out/trajectory.txt\n"
    "  ygslam eval --gt SEQUENCE/groundtruth.txt --est a.txt b.txt c.txt      # one table\n"
    "  ygslam eval --gt gt.txt --est a.txt --plot a.svg --errors a.csv --json # for papers\n"
    "  ygslam eval --gt poses/00.txt --est 00.txt --times sequences/00/times.txt   # KITTI\n"
    "  ygslam eval --gt mav0/state_groundtruth_estimate0/data.csv --est vio.txt --align sim3\n"
    "  ygslam eval --gt robot.mcap --gt-topic /odom --est out/trajectory.txt       # bags, too\n"
    "  ygslam eval --gt seq-01 --est out/trajectory.txt          # 7-Scenes: one pose a file\n"
    "  ygslam eval --gt gt.txt --est robot.txt --offset -0.035   # its stamps are 35 ms late\n"
    "  ygslam eval --tracks --gt out/tracks_truth.txt --est out/tracks.txt   # of `inspect`\n"
    "  ygslam eval --map scene/mesh.ply --truth SEQ --est out/trajectory.txt   # of `run "
    "--export`\n"
    "Exit codes: 0 ok, 2 usage, 4 a file that cannot be used or no common time, 9 output not\n"
    "written, 141 its reader left (| head).";

}  // namespace

void add_eval_command(CLI::App& app, int& exit_code) {
  const auto arguments = std::make_shared<EvalArguments>();
  CLI::App* command = app.add_subcommand(
      "eval", "Errors against ground truth: of trajectories (ATE, RPE), tracks and maps");
  declare_options(*command, *arguments);
  command->footer(kEvalFooter);
  command->callback([arguments, &exit_code] {
    const auto text = run_eval(*arguments);
    if (text.ok()) {
      print_text(*text);
      tell_files(*arguments);
      return;
    }
    log::error("{}", text.error().message);
    exit_code = static_cast<int>(text.error().kind);
  });
}

}  // namespace ygslam
