#include "app/commands.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/background_files.hpp"
#include "app/exit_code.hpp"
#include "app/frame_writer.hpp"
#include "app/program_log.hpp"
#include "app/progress_bar.hpp"
#include "app/recording_check.hpp"
#include "app/run_options.hpp"
#include "app/run_targets.hpp"
#include "app/scene_output.hpp"
#include "app/stop_signal.hpp"
#include "core/counted.hpp"
#include "core/statistics.hpp"
#include "eval/report.hpp"
#include "io/atomic_file.hpp"
#include "io/trajectory_formats.hpp"
#include "live/run_recorder.hpp"
#include "segment/movable.hpp"
#include "system/dense_file.hpp"
#include "system/map_saver.hpp"
#include "system/metrics.hpp"
#include "system/run_writer.hpp"

namespace ygslam {
namespace {

struct Run {
  RunOptions options;
  SlamConfig config;
  Sequence sequence;
  std::unique_ptr<FrameReader> reader;
  std::unique_ptr<MapSaver> map_saver;  // the session's map goes to it
  SessionOptions session_options;
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
  const bool is_replaced = replaces_map(run.options);
  auto saver = MapSaver::open(run.options.save_map, Camera(run.sequence.camera),
                              {orb.levels, orb.scale_factor});
  if (!saver.ok()) return saver.error();
  run.map_saver = std::move(saver).value();
  if (is_replaced)
    log::warn("{}: the map in it is replaced; --load-map would go on with it",
              run.options.save_map);
  return Ok{};
}

Status prepare(Run& run) {
  const RunOptions& o = run.options;
  Status settings = load_settings(o, run.config);
  if (!settings.ok()) return settings;
  const auto config = resolved(run.config);
  if (!config.ok()) return config.error();
  if (!config->dense.enabled && !(o.export_dir.empty() && o.background_dir.empty()))
    return Error{ErrorKind::kConfig,
                 "run.without: leaves out dense_map, of which --export and --background are made"};
  SessionOptions& session = run.session_options;
  Status segmenter = choose_segmenter(o.segmenter, o.model, session);
  if (!segmenter.ok()) return segmenter;
  auto sequence = open_sequence(o);
  if (!sequence.ok()) return sequence.error();
  run.sequence = std::move(sequence).value();
  if (Status range = check_range(o, run.sequence); !range.ok()) return range;
  if (Status targets = check_targets(o, run.sequence); !targets.ok()) return targets;
  session.config = run.config;
  session.config.run.keep_trajectory = false;  // FrameFiles does, in a file
  session.config.run.shutter_source = run.sequence.shutter_source;
  session.camera = run.sequence.camera;
  session.deterministic = o.deterministic;
  session.may_wait = !o.realtime;
  session.may_fork = true;
  session.load_map = o.load_map;
  session.localize_only = o.localize;
  if (!o.save_map.empty()) session.map_sink = [&run](const Map& map) { run.map_saver->look(map); };
  auto opened = open_session(session);
  if (!opened.ok()) return opened.error();
  run.session = std::move(opened).value();
  for (const std::string& warning : run.sequence.warnings) log::warn("{}", warning);
  return Ok{};
}

FrameReaderConfig reader_config(const Run& run) {
  const RunOptions& o = run.options;
  FrameReaderConfig config;
  config.from = o.from;
  if (o.to > 0) config.to = o.to;
  config.stride = o.stride;
  config.realtime = o.realtime;
  config.depth = run.config.depth;
  return config;
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
Status await_turn(Run& run, const RgbdFrame& frame, ProgressBar& progress) {
  Runner& runner = *run.session.runner;
  for (;;) {
    if (run.view->is_paused()) progress.update(index(frame.id), "paused on the page");
    run.reader->pause();  // what the page waits makes no frame late
    const auto wishes =
        run.view->wait_turn(frame.stamp, &runner, [] { return StopSignal::received() != 0; });
    run.reader->resume();
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
  auto writers = FrameWriters::create(o);
  if (!writers.ok()) return writers.error();
  auto files = FrameFiles::create(o.out_dir, run.sequence.stamp_decimals, !o.deterministic);
  if (!files.ok()) return files.error();
  run.files = std::move(*files);
  run.session.runner->add_sink(log_frame);
  run.session.runner->add_sink(
      [&run](const FrameRecord& record, const TrackResult&) { run.files->add(record); });
  std::optional<RunRecorder> recorder;
  Status recorded = Ok{};
  if (o.view.address) {
    auto started = start_page(o.view, {.camera = run.sequence.camera,
                                       .paced = o.realtime,
                                       .map = o.save_map.empty() ? RunViewConfig::Map::kResets
                                                                 : RunViewConfig::Map::kSaves});
    if (!started.ok()) return started.error();
    run.view = std::move(started).value();
  }
  ProgressBar progress(run.reader->counts().offered, is_quiet());
  bool first = true;
  while (auto frame = run.reader->next(run.view ? run.view->stop_token() : std::stop_token())) {
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
      if (Status due = await_turn(run, **frame, progress); !due.ok()) return due;
      if (run.stopped) break;
    }
    const TrackResult result = run.session.runner->process(*frame);
    writers->add(*frame, result);
    if (run.view) {
      run.view->show(*frame, result);
      run.view->show_map(*run.session.runner);
    }
    if (recorder && recorded.ok()) recorded = recorder->add(**frame, result, *run.session.runner);
    progress.update(index((*frame)->id) + 1, to_string(result.state));
    if (StopSignal::received()) break;
  }
  run.interrupted_by = StopSignal::received();
  run.stopped = run.view && run.view->stop_token().stop_requested();
  const SlamOutcome& outcome = run.session.runner->finish();
  const Status pictures = writers->finish();
  if (outcome.statistics.frames == 0 && !run.interrupted_by && !run.stopped) {
    return Error{ErrorKind::kInput, o.sequence + ": not one frame could be read"};
  }
  if (recorder && recorded.ok()) recorded = recorder->finish(*run.session.runner);
  return pictures.ok() ? recorded : pictures;
}

/// Names of images may be any bytes.
std::string text_of(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

void add_truth(const Run& run, std::span<const StampedPose> trajectory,
               nlohmann::ordered_json& metrics, LogFile& log_file) {
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
  log_file.tell(
      fmt::format("ATE RMSE {:.4f} m over {}: trajectory.txt aligned (SE(3)) to the ground truth",
                  report->ate_m.rmse, counted(report->pairs, "pose")));
}

Status write_outputs(Run& run, const SlamOutcome& outcome, LogFile& log_file) {
  const std::filesystem::path out = run.options.out_dir;
  const Map map = run.session.runner->map();
  // The map comes first: it lies elsewhere, and what befalls the folder must not cost it.
  const Status saved = run.map_saver ? run.map_saver->finish(map) : Status(Ok{});
  const auto posed = run.files->trajectory();
  if (!posed.ok()) return posed.error();
  const std::vector<StampedPose> trajectory = final_trajectory(*posed, outcome.revised, map);
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
  const FrameReaderCounts counts = run.reader->counts();
  auto metrics = metrics_json(outcome, map, counts, run.facts);
  log_file.tell(summary_text(outcome, map, counts, run.facts));
  add_truth(run, trajectory, metrics, log_file);
  written = write_file_atomically(out / "metrics.json", text_of(metrics));
  if (!written.ok()) return written;
  SlamConfig config = run.config;
  written = write_file_atomically(out / "config.yaml", schema_of(config).to_yaml());
  return written.ok() ? saved : written;
}

/// Beside the map that has the poses.
Status save_dense_map(Run& run) {
  if (!run.map_saver || !run.config.dense.enabled) return Ok{};
  std::vector<SavedView> views;
  run.session.runner->inspect_dense([&](DenseMap& dense) { views = dense.saved(); });
  return save_dense_views(dense_file_of(run.options.save_map), *run.session.camera, views);
}

/// The recording once more, with the final map.
Status write_background(Run& run, const SlamOutcome& outcome) {
  const ScopedTimer timer;
  log::info("background: the recording is drawn once more, to {}", run.options.background_dir);
  const auto trajectory = run.files->trajectory();
  if (!trajectory.ok()) return trajectory.error();
  run.session_options.may_fork = false;  // what was read once can be read again
  const auto segmenter = open_segmenter(run.session_options);
  if (!segmenter.ok()) return segmenter.error();
  const auto config = resolved(run.config);
  if (!config.ok()) return config.error();
  const auto excluded = with_living_classes(config->dynamic.masks.mask.movable_classes);
  FrameReaderConfig reader = reader_config(run);
  reader.realtime = false;
  const Map map = run.session.runner->map();
  Result<BackgroundSummary> done = Error{ErrorKind::kOutput, ""};
  run.session.runner->inspect_dense([&](DenseMap& dense) {
    done = write_background(run.options.background_dir,
                            {run.sequence, reader, *trajectory, outcome.revised, map,
                             *run.session.camera, segmenter->get(), excluded, is_quiet()},
                            dense);
  });
  if (!done.ok()) return done.error();
  run.interrupted_by = done->interrupted_by;
  log::info(
      "background: {} drawn in {:.1f} s; of the pixels {:.1f} % from other views, {:.1f} % from "
      "the "
      "map, {:.1f} % never seen; {:.1f} ms a frame (median CPU time)",
      counted(done->frames, "frame"), timer.wall_ms() / 1000, 100 * done->from_views,
      100 * done->from_map, 100 * done->never_seen, done->draw_cpu_ms.percentile(0.5));
  return Ok{};
}

Result<int> run_all(Run& run) {
  const RunOptions& o = run.options;
  const ScopedTimer startup;
  Status prepared = prepare(run);
  if (!prepared.ok() && StopSignal::received()) return 128 + StopSignal::received();
  if (!prepared.ok()) return prepared.error();
  Status writable = ensure_writable_directory(o.out_dir);
  if (!writable.ok()) return writable.error();
  for (const std::string& folder : {o.export_dir, o.background_dir})
    if (!folder.empty() && writable.ok()) writable = ensure_writable_directory(folder);
  if (!writable.ok()) return writable.error();
  auto lock = OutputLock::acquire(o.out_dir);
  if (!lock.ok()) return lock.error();
  auto log_file = LogFile::open(std::filesystem::path(o.out_dir) / "log.txt");
  if (!log_file.ok()) return log_file.error();
  run.reader = std::make_unique<FrameReader>(run.sequence, reader_config(run));
  run.facts.mode = mode_name(run.config.dynamic.mode);
  run.facts.segmenter = run.session.segmenter;
  run.facts.precision = run.session.precision;
  run.facts.seed = run.config.run.seed;
  run.facts.schedule = o.deterministic ? "deterministic" : o.realtime ? "realtime" : "file";
  run.facts.startup_s = startup.wall_ms() / 1000;
  log::info("{}: {}, camera from {}, mode {}, segmenter {} {}", o.sequence,
            run.sequence.stream ? "a stream" : fmt::format("{} pairs", run.sequence.pairs.size()),
            run.sequence.camera_source, run.facts.mode, run.facts.segmenter, run.facts.precision);
  log_shutter(run.sequence);
  log_registration(run.sequence);

  const ScopedTimer wall;
  Status processed = process_frames(run, *log_file);
  const SlamOutcome& outcome = run.session.runner->finish();
  run.facts.wall_s = wall.wall_ms() / 1000;
  if (outcome.statistics.frames > 0) {
    Status written = write_outputs(run, outcome, *log_file);
    if (written.ok()) written = save_dense_map(run);
    if (!written.ok()) return written.error();
  }
  if (!processed.ok()) return processed.error();
  const bool has_frames = outcome.statistics.frames > 0;
  const bool draws = !o.background_dir.empty() && has_frames && !run.interrupted_by;
  if (draws)
    if (Status drawn = write_background(run, outcome); !drawn.ok()) return drawn.error();
  if (has_frames) log_file->tell(targets_text(o, run.config.dense.enabled, draws));
  if (run.view && o.view.stay) {
    run.view->finish(run.session.runner.get());
    log::info("the page stays until it is interrupted (Ctrl-C)");
    std::fflush(stdout);  // what was told is there to be read meanwhile
    run.view->stay([] { return StopSignal::received() != 0; });
  }
  if (!has_frames)  // nothing to save
    return run.stopped ? 0 : 128 + run.interrupted_by;
  const bool lost = 1 - coverage(outcome) > run.config.run.max_lost_share && !run.interrupted_by;
  if (lost)
    log::warn("{}: lost for {:.0f} % of the frames", o.sequence, 100 * (1 - coverage(outcome)));
  if (Status written = log_file->finish(); !written.ok()) return written.error();
  return run.interrupted_by ? 128 + run.interrupted_by : lost ? kExitLost : 0;
}

void run_and_exit(const RunOptions& options, int& exit_code) {
  StopSignal::watch();
  Run run;
  run.options = options;
  const NewFolders folders(options);
  exit_code = exit_code_of(run_all(run));
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
