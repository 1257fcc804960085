#include "app/commands.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>

#include "app/exit_code.hpp"
#include "app/file_uses.hpp"
#include "app/inspect_loops.hpp"
#include "app/inspect_output.hpp"
#include "app/inspect_run.hpp"
#include "app/standard_streams.hpp"
#include "app/stop_signal.hpp"
#include "core/log.hpp"
#include "io/atomic_file.hpp"

namespace ygslam {
namespace {

Result<int> inspect(const InspectOptions& options) {
  const auto settings = load_settings(options.run);
  if (!settings.ok()) return settings.error();
  auto sequence = open_sequence(options.run);
  if (!sequence.ok()) return sequence.error();
  const std::size_t from = options.run.from;
  const std::size_t to = options.run.to > 0 ? std::min(options.run.to, sequence->pairs.size())
                                            : sequence->pairs.size();
  if (from >= to) {
    return Error{ErrorKind::kUsage, "--from " + std::to_string(from) + " --to " +
                                        std::to_string(options.run.to) + ": no frame of the " +
                                        std::to_string(sequence->pairs.size())};
  }
  for (const std::size_t frame : options.frames) {
    if (frame >= from && frame < to) continue;
    return Error{ErrorKind::kUsage, "--frames " + std::to_string(frame) + ": not among the pairs " +
                                        std::to_string(from) + " to " + std::to_string(to - 1)};
  }
  FileUses uses;
  uses.reads_sequence(options.run.sequence, *sequence);
  uses.writes_in("--out", options.run.out_dir,
                 {"frame_*.jpg", "checks.jpg", "inspect.json", "tracks.txt", "tracks_truth.txt"});
  if (Status checked = uses.check(); !checked.ok()) return checked.error();
  if (!options.run.out_dir.empty()) {
    Status writable = ensure_writable_directory(options.run.out_dir);
    if (!writable.ok()) return writable.error();
  }
  Inspection inspection(options, std::move(sequence).value());
  std::vector<Check> checks;
  for (const std::string& name : options.checks)
    if (Status ready = inspection.ready(make_check(name, *settings)); !ready.ok())
      return ready.error();
  for (const std::string& name : options.checks) {
    checks.push_back(make_check(name, *settings));
    Status ran = inspection.run(checks.back());
    if (!ran.ok()) return ran.error();
    if (const int signal = StopSignal::received()) return 128 + signal;
  }
  const auto json = checks_json(checks, inspection.has_truth());
  if (!options.run.out_dir.empty()) {
    const std::filesystem::path out = options.run.out_dir;
    Status written = write_pictures(out, checks);
    if (written.ok()) written = write_tracks(out, checks);
    if (written.ok()) written = write_file_atomically(out / "inspect.json", json.dump(2) + "\n");
    if (!written.ok()) return written.error();
  }
  if (options.json) {
    print_text(json.dump(2) + "\n");
  } else {
    print_checks(checks, inspection.has_truth());
  }
  return 0;
}

}  // namespace

void add_inspect_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<InspectOptions>();
  CLI::App* command = app.add_subcommand(
      "inspect",
      "See which points are taken for moving (classic check, improved check, full system), or "
      "which loops a run closed");
  add_input_options(*command, options->run);
  command->add_option("--out", options->run.out_dir, "Folder for pictures and inspect.json")
      ->type_name("DIR");
  command->add_option("--frames", options->frames, "Frames to draw, e.g. 44,68,216 (default: six)")
      ->delimiter(',')
      ->type_name("N,N,...");
  command->add_option("--checks", options->checks, "Which to run")
      ->delimiter(',')
      ->check(CLI::IsMember({"classic", "improved", "full"}))
      ->type_name("classic,improved,full")
      ->capture_default_str();
  CLI::Option* loops =
      command
          ->add_option("--loops", options->loops,
                       "In place of all that: what loop closing did in the run in this folder")
          ->type_name("OUT");
  add_range_options(*command, options->run);
  command->add_flag("--live", options->live,
                    "As `run` does: masks when they come (default: offline, two frames late)");
  for (const char* other : {"--out", "--frames", "--checks", "--from", "--to", "--live"})
    loops->excludes(command->get_option(other));
  command->add_flag("--json", options->json, "Print JSON in place of the table");
  command->footer(
      "Examples:\n"
      "  ygslam inspect rgbd_dataset_freiburg3_walking_xyz --out fig5 --model yolov8n-seg.onnx "
      "--frames 44,68,216,499,663,759\n"
      "  ygslam inspect SEQ --checks full --segmenter masks:SEQ/mask --json\n"
      "  ygslam run SEQ --out OUT && ygslam inspect SEQ --loops OUT\n"
      "classic: Harris corners, all vote for the fundamental matrix. improved: ORB points, only\n"
      "those that were static vote, depth as second opinion. full: masks as well.\n"
      "Where the truth is known, points with a white ring were missed, those with a black ring "
      "are\n"
      "false alarms.\n"
      "With mask/ (and moving/) beside the images it prints precision and recall of the dynamic\n"
      "points; unknown points count as static, points at mask edges and on movable things at rest\n"
      "are left out, as are the first 10 frames. Objects are compared with the persons of mask/ "
      "and\n"
      "other things while they move: HOTA, IDF1, MOTA, identity switches, at a box IoU of 0.5.\n"
      "--loops reads OUT/loops.csv. A place that a keyframe was compared with ends at one of "
      "these\n"
      "stages, in this order: few matches (of descriptors), no pose, few inliers, narrow (in too\n"
      "few parts of the image or of space), contradicts (full where the other view saw through),\n"
      "too far (odometry cannot have drifted so much), other submap (begun after a loss; enough "
      "of\n"
      "these join the two), ambiguous (another place fits as well),\n"
      "alone (the keyframes beside it do not agree), inconsistent (the map would have to "
      "stretch),\n"
      "closed. With groundtruth.txt in SEQ a place counts as true if the cameras stood less than\n"
      "3 m apart and looked less than 60 degrees apart. A false place that was closed damages the\n"
      "map.");
  command->callback([options, &exit_code] {
    StopSignal::watch();
    exit_code = options->loops.empty() ? exit_code_of(inspect(*options))
                                       : exit_code_of(inspect_loops(*options));
  });
}

}  // namespace ygslam
