#include "app/run_plan.hpp"

#include "app/run_targets.hpp"
#include "system/dense_file.hpp"

namespace ygslam {
namespace {

Status check_dense_outputs(const RunOptions& options, const SlamConfig& settings) {
  if (settings.dense.enabled || (options.export_dir.empty() && options.background_dir.empty()))
    return Ok{};
  return Error{ErrorKind::kConfig,
               "run.without: leaves out dense_map, of which --export and --background are made"};
}

FrameReaderConfig reader_config(const RunOptions& options, const SlamConfig& settings) {
  FrameReaderConfig config;
  config.from = options.from;
  if (options.to > 0) config.to = options.to;
  config.stride = options.stride;
  config.realtime = options.realtime;
  config.depth = settings.depth;
  return config;
}

void add_session_options(const RunOptions& options, const Sequence& sequence,
                         SessionOptions& session) {
  session.config.run.keep_trajectory = false;  // FrameFiles does, in a file
  session.config.run.shutter_source = sequence.shutter_source;
  session.camera = sequence.camera;
  session.deterministic = options.deterministic;
  session.may_wait = !options.realtime;
  session.may_fork = true;
  session.load_map = options.load_map;
  session.localize_only = options.localize;
}

}  // namespace

std::optional<std::filesystem::path> RunPlan::dense_file() const {
  if (options.save_map.empty() || !settings().dense.enabled) return std::nullopt;
  return dense_file_of(options.save_map);
}

const char* RunPlan::schedule() const {
  return options.deterministic ? "deterministic" : options.realtime ? "realtime" : "file";
}

Result<RunPlan> plan_run(const RunOptions& options) {
  RunPlan plan;
  plan.options = options;
  auto settings = load_settings(options);
  if (!settings.ok()) return settings.error();
  plan.session.config = std::move(settings).value();
  Status checked = check_dense_outputs(options, plan.settings());
  if (checked.ok()) checked = choose_segmenter(options.segmenter, options.model, plan.session);
  if (!checked.ok()) return checked.error();
  auto sequence = open_sequence(options);
  if (!sequence.ok()) return sequence.error();
  plan.sequence = std::move(sequence).value();
  checked = check_range(options, plan.sequence);
  if (checked.ok()) checked = check_targets(options, plan.sequence);
  if (!checked.ok()) return checked.error();
  plan.reading = reader_config(options, plan.settings());
  add_session_options(options, plan.sequence, plan.session);
  auto imu = open_imu(options, plan.sequence);
  if (!imu.ok()) return imu.error();
  plan.session.config.imu = imu->calibration;
  plan.imu = std::move(imu->samples);
  if (!imu->told.empty()) plan.sequence.notes.push_back(std::move(imu->told));
  auto wheels = open_wheels(options, plan.sequence);
  if (!wheels.ok()) return wheels.error();
  plan.session.config.wheels = wheels->calibration;
  plan.wheels = std::move(wheels->samples);
  if (!wheels->told.empty()) plan.sequence.notes.push_back(std::move(wheels->told));
  return plan;
}

}  // namespace ygslam
