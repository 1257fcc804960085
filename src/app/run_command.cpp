#include "app/run_command.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/debug_images.hpp"
#include "app/exit_code.hpp"
#include "app/program_log.hpp"
#include "app/progress_bar.hpp"
#include "app/run_options.hpp"
#include "app/stop_signal.hpp"
#include "core/statistics.hpp"
#include "eval/report.hpp"
#include "geometry/rolling_shutter.hpp"
#include "io/atomic_file.hpp"
#include "live/run_recorder.hpp"
#include "live/run_view.hpp"
#include "scene_file/export_scene.hpp"
#include "system/map_saver.hpp"
#include "system/metrics.hpp"
#include "system/run_writer.hpp"

namespace ygslam {
namespace {

// A wrong depth scale or camera shows in the depth itself: a room's median lies between these, and
// something in view is farther than the last. Over the recordings the bounds were tried on, medians
// are 0.9 to 3.5 m and the 99th percentile at least 1.6 m; at a fifth of the scale that is at most
// 1.3 m, at five times the scale the median of what stays in range is at least 4.7 m.
constexpr float kNearestMedian_m = 0.5F, kFarthestMedian_m = 4.3F, kNearestFar_m = 1.4F;
constexpr double kLeastValidShare = 0.1;

void warn_about_depth(const RgbdFrame& frame) {
  std::vector<float> depths;
  for (const float d : frame.depth_m) {
    if (d > 0) depths.push_back(d);
  }
  const double valid =
      static_cast<double>(depths.size()) / static_cast<double>(frame.depth_m.size());
  if (depths.empty()) {
    log::warn("the first frame has no depth in range: is depth_scale right?");
    return;
  }
  const float median_m = quantile(depths, 0.5);
  const float far_m = quantile(depths, 0.99);
  if (median_m < kNearestMedian_m || median_m > kFarthestMedian_m || far_m < kNearestFar_m ||
      valid < kLeastValidShare) {
    log::warn(
        "the first frame's depth looks odd (median {:.2f} m, nearly all within {:.2f} m, {:.0f} % "
        "of the pixels in range): is depth_scale right?",
        median_m, far_m, 100 * valid);
  }
}

struct Run {
  RunOptions options;
  SlamConfig config;
  Sequence sequence;
  std::unique_ptr<FrameReader> reader;
  std::unique_ptr<MapSaver> map_saver;  // the session's map goes to it
  Session session;
  std::optional<FrameFiles> files;
  std::unique_ptr<RunView> view;
  RunFacts facts;
  int interrupted_by = 0;
  bool stopped = false;  ///< on the live page
};

/// Not before there is a frame: a call that ends in an error leaves no empty map.
Status open_map_saver(Run& run) {
  if (run.options.save_map.empty()) return Ok{};
  const OrbConfig& orb = run.config.orb;
  auto saver = MapSaver::open(run.options.save_map, Camera(run.sequence.camera),
                              {orb.levels, orb.scale_factor});
  if (!saver.ok()) return saver.error();
  run.map_saver = std::move(saver).value();
  return Ok{};
}

Status prepare(Run& run) {
  const RunOptions& o = run.options;
  Status settings = load_settings(o, run.config);
  if (!settings.ok()) return settings;
  SessionOptions session;
  Status segmenter = parse_segmenter(o, session);
  if (!segmenter.ok()) return segmenter;
  auto sequence = open_sequence(o);
  if (!sequence.ok()) return sequence.error();
  run.sequence = std::move(sequence).value();
  if (Status range = check_range(o, run.sequence); !range.ok()) return range;
  session.config = run.config;
  session.config.run.keep_trajectory = false;  // FrameFiles does, in a file
  session.camera = run.sequence.camera;
  session.deterministic = o.deterministic;
  session.may_wait = !o.realtime;
  session.may_fork = true;
  session.load_map = o.load_map;
  session.localize_only = o.localize;
  if (!o.save_map.empty()) session.map_sink = [&run](const Map& map) { run.map_saver->look(map); };
  auto opened = open_session(std::move(session));
  if (!opened.ok()) return opened.error();
  run.session = std::move(opened).value();
  for (const std::string& warning : run.sequence.warnings) log::warn("{}", warning);
  return Ok{};
}

void start_reader(Run& run) {
  const RunOptions& o = run.options;
  FrameReaderConfig config;
  config.from = o.from;
  if (o.to > 0) config.to = o.to;
  config.stride = o.stride;
  config.realtime = o.realtime;
  config.depth = run.config.depth;
  run.reader = std::make_unique<FrameReader>(run.sequence, config);
}

Result<std::unique_ptr<RunView>> start_view(const Run& run) {
  const RunOptions& o = run.options;
  auto config = parse_view_address(*o.view);
  if (!config.ok()) return config.error();
  constexpr const char* kOfTokens =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";  // as in addresses
  if (o.view_token.find_first_not_of(kOfTokens) != std::string::npos)
    return Error{ErrorKind::kUsage, "--view-token: letters, digits and -._~ only"};
  config->token = o.view_token;
  config->origins = o.view_origins;
  auto view = RunView::start(
      {*config, run.sequence.camera, o.realtime, !o.save_map.empty(), o.view_paused});
  if (!view.ok()) return view.error();
  std::fprintf(stderr, "look at %s\n", (*view)->url().c_str());
  return view;
}

/// Forgets all that was, in the run's files too.
Status begin_anew(Run& run) {
  run.session.runner->reset();
  auto files = FrameFiles::create(run.options.out_dir, run.sequence.stamp_decimals,
                                  !run.options.deterministic);
  if (!files.ok()) return files.error();
  run.files = std::move(*files);
  log::info("begun anew, as the live page asked");
  return Ok{};
}

/// Does what those who drive wish until the frame is due, or the run is stopped or interrupted.
Status await_turn(Run& run, Timestamp stamp) {
  Runner& runner = *run.session.runner;
  for (;;) {
    const auto wishes =
        run.view->wait_turn(stamp, runner, [] { return StopSignal::received() != 0; });
    if (wishes.save && run.map_saver) run.map_saver->save(runner.map());
    if (wishes.reset) {
      if (Status begun = begin_anew(run); !begun.ok()) return begun;
      run.view->restart();
    }
    run.stopped = wishes.stop;
    if (wishes.stop || wishes.go || StopSignal::received()) return Ok{};
  }
}

Status process_frames(Run& run, LogFile& log_file) {
  const RunOptions& o = run.options;
  std::optional<DebugImages> pictures;
  if (!o.debug_dir.empty()) {
    Status writable = ensure_writable_directory(o.debug_dir);
    if (!writable.ok()) return writable;
    pictures.emplace(o.debug_dir, o.debug_every);
  }
  auto files = FrameFiles::create(o.out_dir, run.sequence.stamp_decimals, !o.deterministic);
  if (!files.ok()) return files.error();
  run.files = std::move(*files);
  run.session.runner->add_sink(log_frame);
  run.session.runner->add_sink(
      [&run](const FrameRecord& record, const TrackResult&) { run.files->add(record); });
  std::optional<RunRecorder> recorder;
  Status recorded = Ok{};
  if (o.view) {
    auto started = start_view(run);
    if (!started.ok()) return started.error();
    run.view = std::move(started).value();
  }
  ProgressBar progress(run.reader->counts().offered, is_quiet());
  bool first = true;
  std::optional<Error> picture_error;
  while (auto frame = run.reader->next()) {
    if (std::exchange(first, false)) {
      if (Status opened = open_map_saver(run); !opened.ok()) return opened;
      if (!o.mcap.empty()) {
        auto created = RunRecorder::create(o.mcap, run.sequence.camera);
        if (!created.ok()) return created.error();
        recorder = std::move(created).value();
      }
      // Not before: a run without a frame leaves an earlier one's files alone.
      if (Status placed = log_file.place(); !placed.ok()) return placed;
      warn_about_depth(**frame);
    }
    if (run.view) {
      if (Status due = await_turn(run, (*frame)->stamp); !due.ok()) return due;
      if (run.stopped) break;
    }
    const TrackResult result = run.session.runner->process(*frame);
    if (pictures && !picture_error) {
      Status drawn = pictures->add(*frame, result);
      if (!drawn.ok()) picture_error = drawn.error();
    }
    if (run.view) {
      run.view->show(*frame, result);
      run.view->show_map(*run.session.runner);
    }
    if (recorder && recorded.ok()) recorded = recorder->add(**frame, result, *run.session.runner);
    progress.update(index((*frame)->id) + 1, to_string(result.state));
    run.interrupted_by = StopSignal::received();
    if (run.interrupted_by) break;
  }
  const SlamOutcome& outcome = run.session.runner->finish();
  if (pictures && !picture_error) {
    Status drawn = pictures->finish();
    if (!drawn.ok()) picture_error = drawn.error();
  }
  if (outcome.statistics.frames == 0 && !run.interrupted_by && !run.stopped) {
    return Error{ErrorKind::kInput, o.sequence + ": not one frame could be read"};
  }
  if (recorder && recorded.ok()) recorded = recorder->finish(*run.session.runner);
  if (picture_error) return *picture_error;
  return recorded;
}

void add_truth(const Run& run, std::span<const StampedPose> trajectory,
               nlohmann::ordered_json& metrics) {
  if (!run.sequence.groundtruth) return;
  const auto truth = read_tum_trajectory(*run.sequence.groundtruth);
  if (!truth.ok()) {
    log::warn("{}", truth.error().message);
    return;
  }
  const auto report = evaluate(*truth, trajectory);
  if (!report.ok()) {
    log::warn("{}: {}", run.sequence.groundtruth->string(), report.error().message);
    return;
  }
  const nlohmann::json json = to_json(*report);
  for (const char* key : {"ate", "rpe", "alignment", "pairs"}) {
    if (json.contains(key)) metrics[key] = json[key];
  }
  if (!is_quiet())
    std::printf("ATE RMSE %.4f m over %zu poses\n", report->ate_m.rmse, report->pairs);
}

Status write_scene(const std::filesystem::path& folder, const StaticScene& scene) {
  if (scene.mesh.triangles.empty())
    log::warn("{}: nothing of the static scene was seen, its files are empty", folder.string());
  return export_scene(
      folder, {scene.mesh.vertices, scene.mesh, scene.space, scene.objects, scene.gravity, {}});
}

Status write_outputs(Run& run, const SlamOutcome& outcome) {
  const std::filesystem::path out = run.options.out_dir;
  const Map map = run.session.runner->map();
  // The map comes first: it lies elsewhere, and what befalls the folder must not cost it.
  const Status saved = run.map_saver ? run.map_saver->finish(map) : Status(Ok{});
  const auto posed = run.files->trajectory();
  if (!posed.ok()) return posed.error();
  const std::vector<StampedPose> trajectory = final_trajectory(*posed, map);
  if (trajectory.size() < posed->size())
    log::warn(
        "{} tracked frames are of a submap, begun after a loss, that was never joined to the rest: "
        "trajectory.txt leaves them out",
        posed->size() - trajectory.size());
  Status written = Ok{};
  std::optional<StaticScene> scene;
  if (!run.options.export_dir.empty()) scene = run.session.runner->scene();
  if (run.options.localize) {
    written = write_file_atomically(out / "trajectory.txt",
                                    format_tum(trajectory, run.sequence.stamp_decimals));
  } else {
    written = write_run(out, trajectory, map,
                        scene ? coloured_points(scene->mesh) : run.session.runner->cloud(),
                        run.sequence.stamp_decimals);
  }
  if (written.ok() && scene) written = write_scene(run.options.export_dir, *scene);
  if (written.ok())
    written = write_file_atomically(
        out / "loops.csv",
        loops_csv(run.session.runner->loop_attempts(), run.sequence.stamp_decimals));
  if (written.ok()) written = run.files->commit();
  if (!written.ok()) return written;
  auto metrics = metrics_json(outcome, map, run.reader->counts(), run.facts);
  if (!is_quiet()) {
    std::printf("%llu frames, %.1f %% tracked, %zu keyframes, %zu landmarks, %.1f s\n",
                static_cast<unsigned long long>(outcome.statistics.frames), 100 * coverage(outcome),
                map.keyframes().size(), map.landmark_count(), run.facts.wall_s);
  }
  add_truth(run, trajectory, metrics);
  written = write_file_atomically(out / "metrics.json", metrics.dump(2) + "\n");
  if (!written.ok()) return written;
  SlamConfig config = run.config;
  written = write_file_atomically(out / "config.yaml", schema_of(config).to_yaml());
  return written.ok() ? saved : written;
}

void log_shutter(const Sequence& sequence) {
  const CameraConfig& camera = sequence.camera;
  if (!shutter_times(camera).is_global()) {
    log::info("shutter from {}: colour is read in {} ms, depth in {} ms, {} ms later",
              sequence.shutter_source, camera.colour_readout_ms, camera.depth_readout_ms,
              camera.depth_delay_ms);
  } else if (!camera.shutter_known) {
    log::info(
        "shutter unknown, taken as global: `camera NAME` or colour_readout_ms and "
        "depth_readout_ms in the camera file tell of another (docs/camera.md)");
  }
}

Result<int> run_all(Run& run) {
  const RunOptions& o = run.options;
  const ScopedTimer startup;
  Status prepared = prepare(run);
  if (!prepared.ok()) return prepared.error();
  Status writable = ensure_writable_directory(o.out_dir);
  if (!writable.ok()) return writable.error();
  if (!o.export_dir.empty()) writable = ensure_writable_directory(o.export_dir);
  if (!writable.ok()) return writable.error();
  auto lock = OutputLock::acquire(o.out_dir);
  if (!lock.ok()) return lock.error();
  auto log_file = LogFile::open(std::filesystem::path(o.out_dir) / "log.txt");
  if (!log_file.ok()) return log_file.error();
  start_reader(run);
  run.facts.mode = mode_name(run.config.dynamic.mode);
  run.facts.segmenter = run.session.segmenter;
  run.facts.precision = run.session.precision;
  run.facts.seed = run.config.run.seed;
  run.facts.schedule = o.deterministic ? "deterministic" : o.realtime ? "realtime" : "file";
  run.facts.startup_s = startup.wall_ms() / 1000;
  log::info("{}: {} pairs, camera from {}, mode {}, segmenter {} {}", o.sequence,
            run.sequence.pairs.size(), run.sequence.camera_source, run.facts.mode,
            run.facts.segmenter, run.facts.precision);
  log_shutter(run.sequence);

  const ScopedTimer wall;
  Status processed = process_frames(run, *log_file);
  const SlamOutcome& outcome = run.session.runner->finish();
  run.facts.wall_s = wall.wall_ms() / 1000;
  if (outcome.statistics.frames > 0) {
    Status written = write_outputs(run, outcome);
    if (!written.ok()) return written.error();
  }
  if (!processed.ok()) return processed.error();
  if (run.view && o.view_stay) {
    run.view->finish(*run.session.runner);
    log::info("the page stays until it is interrupted (Ctrl-C)");
    run.view->stay([] { return StopSignal::received() != 0; });
  }
  if (outcome.statistics.frames == 0)  // nothing to save
    return run.stopped ? 0 : 128 + run.interrupted_by;
  const bool lost = 1 - coverage(outcome) > run.config.run.max_lost_share && !run.interrupted_by;
  if (lost)
    log::warn("{}: lost for {:.0f} % of the frames", o.sequence, 100 * (1 - coverage(outcome)));
  if (Status written = log_file->finish(); !written.ok()) return written.error();
  return run.interrupted_by ? 128 + run.interrupted_by : lost ? kExitLost : 0;
}

// Like run_all(), but a run that wrote nothing leaves no new folder.
Result<int> run_and_tidy(Run& run) {
  std::error_code code;
  const bool is_new = !std::filesystem::exists(run.options.out_dir, code);
  auto result = run_all(run);
  if (is_new && !code) std::filesystem::remove(run.options.out_dir, code);  // if it is empty
  return result;
}

void add_run_options(CLI::App& command, RunOptions& o) {
  command.add_option("--out", o.out_dir, "Folder for the results")->required()->type_name("DIR");
  command
      .add_option("--dynamic", o.dynamic_mode,
                  "off: everything is static; geometry: epipolar check; semantic: masks; "
                  "full: both (default)")
      ->type_name("off|geometry|semantic|full");
  // Of an unsigned number CLI11 takes "-1" as the largest one.
  command.add_option("--from", o.from, "First pair")->check(CLI::NonNegativeNumber)->type_name("N");
  command.add_option("--to", o.to, "One past the last pair")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N");
  command.add_option("--stride", o.stride, "Every n-th pair")
      ->check(CLI::Range(1, 1000000))
      ->type_name("N");
  command.add_flag("--realtime", o.realtime, "Feed frames at their stamps, drop when late");
  command
      .add_flag("--deterministic", o.deterministic,
                "One schedule: same input, same bytes (masks come 2 frames late)")
      ->excludes("--realtime");
  command.add_option("--debug-images", o.debug_dir, "Draw masks and labelled points here")
      ->type_name("DIR");
  command.add_option("--debug-every", o.debug_every, "Draw every n-th frame")
      ->check(CLI::Range(1, 1000000))
      ->type_name("N");
}

void declare_options(CLI::App& command, RunOptions& o) {
  add_input_options(command, o);
  command.add_option("--load-map", o.load_map, "Go on with the map of an earlier run")
      ->type_name("FILE");
  command
      .add_option("--save-map", o.save_map,
                  "Keep the map in this file while it grows (see docs/maps.md)")
      ->type_name("FILE");
  CLI::Option* view =
      command
          .add_option("--view", o.view,
                      "Show the run on a page, by default at 127.0.0.1:8765 (docs/live.md)")
          ->expected(0, 1)
          ->default_str("")
          ->type_name("[[ADDRESS:]PORT]");
  command
      .add_flag("--view-paused", o.view_paused, "Wait before the first frame for Resume or Step")
      ->needs(view);
  command.add_flag("--view-stay", o.view_stay, "Keep the page after the end, until Ctrl-C")
      ->needs(view);
  command
      .add_option("--view-token", o.view_token,
                  "Whoever knows it may drive the run; needed to look on from other machines "
                  "(default: a new one)")
      ->needs(view)
      ->type_name("TEXT");
  command
      .add_option("--view-origin", o.view_origins,
                  "Page of another program that may connect, e.g. https://app.example.org")
      ->needs(view)
      ->type_name("ORIGIN");
  command
      .add_option("--mcap", o.mcap,
                  "Record what is seen and found, for Foxglove, Lichtblick, Rerun (docs/live.md)")
      ->type_name("FILE");
  command
      .add_option(
          "--export", o.export_dir,
          "Write the static scene here: mesh, cloud, OctoMap, ground plan (docs/exports.md)")
      ->type_name("DIR");
  add_run_options(command, o);
  command.footer(
      "Examples:\n"
      "  ygslam run rgbd_dataset_freiburg3_walking_xyz --out out --model yolov8n-seg.onnx\n"
      "  ygslam run SEQ --out out --dynamic geometry          # no network needed\n"
      "  ygslam run SEQ --out out --segmenter masks:SEQ/mask  # recorded masks\n"
      "Writes trajectory.txt, trajectory_live.txt, keyframes.txt, frames.csv, "
      "objects.csv,\n"
      "loops.csv, map.ply, metrics.json, config.yaml, log.txt. Exit codes: 0 ok, 2 usage, 3 "
      "settings "
      "or "
      "camera, 4 input, 5 model, 6 map file,\n"
      "7 lost for more than run.max_lost_share, 9 output not written, 130/143 interrupted "
      "(saved).");
}

void declare_localize_options(CLI::App& command, RunOptions& o) {
  add_input_options(command, o);
  command.add_option("--map", o.load_map, "Map of an earlier run (--save-map); stays as it is")
      ->required()
      ->type_name("FILE");
  add_run_options(command, o);
  command.footer(
      "Example:\n"
      "  ygslam run MONDAY --out mapped --save-map office.ygmap --model yolov8n-seg.onnx\n"
      "  ygslam localize TUESDAY --map office.ygmap --out localized --model yolov8n-seg.onnx\n"
      "Poses are in the frame of the map. Until the place is recognised frames are lost.\n"
      "Writes trajectory.txt, trajectory_live.txt, frames.csv, objects.csv, loops.csv, "
      "metrics.json,\nconfig.yaml, log.txt. Exit codes as of run; 6 where the map is damaged, "
      "empty or of "
      "another camera.");
}

void run_and_exit(const RunOptions& options, int& exit_code) {
  const StopSignal signal;
  Run run;
  run.options = options;
  exit_code = exit_code_of(run_and_tidy(run));
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
  declare_options(*command, *options);
  command->callback([options, &exit_code] { run_and_exit(*options, exit_code); });
}

}  // namespace ygslam
