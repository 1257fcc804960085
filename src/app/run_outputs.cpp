#include "app/run_outputs.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/background_files.hpp"
#include "app/scene_output.hpp"
#include "core/counted.hpp"
#include "core/trace.hpp"
#include "eval/report.hpp"
#include "io/atomic_file.hpp"
#include "io/trajectory_formats.hpp"
#include "map_file/map_file.hpp"
#include "system/dense_beside.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;

/// Names of images may be any bytes.
std::string text_of(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

void add_truth(const RunPlan& plan, std::span<const StampedPose> trajectory,
               nlohmann::ordered_json& metrics, LogFile& log_file) {
  const auto& file = plan.sequence.groundtruth;
  if (!file) return;
  const auto truth = read_stamped_trajectory(*file);
  if (!truth.ok()) {
    log::warn("{}", truth.error().message);
    return;
  }
  const auto report = evaluate(*truth, trajectory);
  if (!report.ok()) {
    log::warn("{}: {}", file->string(), report.error().message);
    return;
  }
  const nlohmann::json json = to_json(*report);
  for (const char* key : {"ate", "rpe", "alignment", "pairs", "body"}) {
    if (json.contains(key)) metrics[key] = json[key];
  }
  log_file.tell(
      fmt::format("ATE RMSE {:.4f} m over {}: trajectory.txt aligned (SE(3)) to the ground truth",
                  report->ate_m.rmse, counted(report->pairs, "pose")));
  for (const std::string& note : report->truth_notes) log::warn("{}", note);
}

Result<std::vector<StampedPose>> run_trajectory(const Map& map, ActiveRun& run) {
  const auto posed = run.files->trajectory();
  if (!posed.ok()) return posed.error();
  const auto revised = run.files->revised(map, run.session.runner->finish().revised);
  if (!revised.ok()) return revised.error();
  std::vector<StampedPose> trajectory = final_trajectory(*posed, *revised, map);
  if (trajectory.size() < posed->size())
    log::warn(
        "{} tracked frames are of a submap, begun after a loss, that was never joined to the rest: "
        "trajectory.txt leaves them out",
        posed->size() - trajectory.size());
  return trajectory;
}

/// trajectory.txt, keyframes.txt and map.ply, loops.csv, and what grew with the run.
/// @param scene of --export.
Status write_results(const RunPlan& plan, std::span<const StampedPose> trajectory, const Map& map,
                     const std::optional<StaticScene>& scene, ActiveRun& run) {
  const fs::path out = plan.options.out_dir;
  const int decimals = plan.sequence.stamp_decimals;
  Runner& runner = *run.session.runner;
  Status written =
      plan.options.localize
          ? write_file_atomically(out / "trajectory.txt", format_tum(trajectory, decimals))
          : write_run(out, trajectory, map, scene ? coloured_points(scene->mesh) : runner.cloud(),
                      decimals);
  if (written.ok())
    written = write_file_atomically(out / "loops.csv", loops_csv(runner.loop_attempts(), decimals));
  return written.ok() ? run.files->commit() : written;
}

Status write_metrics(const RunPlan& plan, RunFacts facts, std::span<const StampedPose> trajectory,
                     const Map& map, ActiveRun& run, LogFile& log_file) {
  facts.trajectory_frames = trajectory.size();
  const fs::path out = plan.options.out_dir;
  const SlamOutcome& outcome = run.session.runner->finish();
  const FrameReaderCounts counts = run.reader->counts();
  auto metrics = metrics_json(outcome, map, counts, facts);
  log_file.tell(summary_text(outcome, map, counts, facts));
  add_truth(plan, trajectory, metrics, log_file);
  if (Status written = write_file_atomically(out / "metrics.json", text_of(metrics)); !written.ok())
    return written;
  SlamConfig settings = plan.settings();
  return write_file_atomically(out / "config.yaml", schema_of(settings).to_yaml());
}

/// What lies there and is neither of this map nor of the one that it replaced is not lost.
Status make_way_for_dense(const fs::path& file, const Map& map, const ActiveRun& run) {
  std::vector<MapIdentity> own;
  for (const auto& identity : {map.identity(), run.replaced_map})
    if (identity) own.push_back(*identity);
  std::error_code code;
  if (is_dense_of(file, own) || fs::equivalent(file, run.session.dense_file, code)) return Ok{};
  const auto aside = put_aside(file);
  if (!aside.ok()) return aside.error();
  log::warn("{}: was of another map, and is now {}", file.string(), aside->string());
  return Ok{};
}

/// The file of --save-map as it is at the end, once more where somebody removed it meanwhile.
Status save_last_map(const RunPlan& plan, const Map& map, ActiveRun& run) {
  if (!run.map_saver) return Ok{};
  if (Status saved = run.map_saver->finish(map); !saved.ok()) return saved;
  const std::string& file = plan.options.save_map;
  std::error_code code;
  if (fs::exists(file, code)) return Ok{};
  log::warn("{}: was removed during the run, and is written once more", file);
  return save_map(file, map, *run.session.camera);
}

/// Beside the map that has the poses.
Status save_dense_map(const RunPlan& plan, const ActiveRun& run, const Map& map) {
  const auto file = plan.dense_file();
  if (!file) return Ok{};
  std::vector<SavedView> views;
  run.session.runner->inspect_dense([&](DenseMap& dense) { views = dense.saved(); });
  std::erase_if(views,
                [&](const SavedView& view) { return !map.has_keyframe(tie_of(view).keyframe); });
  if (Status free = make_way_for_dense(*file, map, run); !free.ok()) return free;
  return save_dense_views(*file, *run.session.camera, map, views);
}

}  // namespace

Status write_outputs(const RunPlan& plan, const RunFacts& facts, ActiveRun& run,
                     LogFile& log_file) {
  const trace::Span span("write outputs");
  const Map map = run.session.runner->map();
  // The map comes first, the scene last: they lie elsewhere, and what befalls one place must not
  // cost what goes to another.
  const Status saved = save_last_map(plan, map, run);
  const auto trajectory = run_trajectory(map, run);
  if (!trajectory.ok()) return trajectory.error();
  std::optional<StaticScene> scene;
  if (!plan.options.export_dir.empty()) scene = run.session.runner->scene();
  Status written = write_results(plan, *trajectory, map, scene, run);
  if (written.ok()) written = write_metrics(plan, facts, *trajectory, map, run, log_file);
  if (!written.ok()) return written;
  const Status kept = saved.ok() ? save_dense_map(plan, run, map) : saved;
  const Status exported = scene ? write_scene(plan.options.export_dir, *scene) : Status(Ok{});
  return kept.ok() ? exported : kept;
}

Status draw_background(const RunPlan& plan, ActiveRun& run) {
  const ScopedTimer timer;
  const std::string& folder = plan.options.background_dir;
  log::info("background: the recording is drawn once more, to {}", folder);
  const auto trajectory = run.files->trajectory();
  if (!trajectory.ok()) return trajectory.error();
  SessionOptions session = plan.session;
  session.may_fork = false;  // what was read once can be read again
  const auto segmenter = open_segmenter(session);
  if (!segmenter.ok()) return segmenter.error();
  FrameReaderConfig reading = plan.reading;
  reading.realtime = false;
  Runner& runner = *run.session.runner;
  const Map map = runner.map();
  const auto revised = run.files->revised(map, runner.finish().revised);
  if (!revised.ok()) return revised.error();
  Result<BackgroundSummary> done = Error{ErrorKind::kOutput, ""};
  runner.inspect_dense([&](DenseMap& dense) {
    done =
        write_background(folder,
                         {plan.sequence, reading, *trajectory, *revised, map, *run.session.camera,
                          segmenter->get(), plan.settings().dynamic.masks.mask.movable, is_quiet()},
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

}  // namespace ygslam
