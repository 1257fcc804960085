#include "app/commands.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>

#include "app/exit_code.hpp"
#include "app/file_uses.hpp"
#include "app/program_log.hpp"
#include "app/progress_bar.hpp"
#include "app/run_options.hpp"
#include "app/standard_streams.hpp"
#include "app/stop_signal.hpp"
#include "core/log.hpp"
#include "io/atomic_file.hpp"
#include "io/calibration.hpp"
#include "io/ignored_pixels.hpp"

namespace ygslam {
namespace {

constexpr int kRounds = 4;  // each tracks the recording with what the one before found
constexpr double kDelayStep = 3;
constexpr double kMs = 1e-3;
constexpr double kSigmas = 3.0;
constexpr double kMostTime_ms = 100;

/// A number of the camera that is looked for.
struct Wanted {
  CameraParameter parameter;
  const char* name;
  const char* unit;
  double per_unit;  // of the estimator's unit
  double told_std;  // in `unit`: a larger standard deviation says nothing
};
constexpr std::array<Wanted, 7> kWanted = {{
    {CameraParameter::kColourReadout, "colour_readout_ms", "ms", kMs, 2},
    {CameraParameter::kDepthReadout, "depth_readout_ms", "ms", kMs, 5},
    {CameraParameter::kDepthDelay, "depth_delay_ms", "ms", kMs, 3},
    {CameraParameter::kFocalLength, "focal length", "%", 0.01, 1},
    {CameraParameter::kCentreX, "cx", "px", 1, 3},
    {CameraParameter::kCentreY, "cy", "px", 1, 3},
    {CameraParameter::kDepthBias, "depth bias", "%/m", 0.01, 0.5},
}};

double CameraConfig::*shutter_time(CameraParameter parameter) {
  switch (parameter) {
    case CameraParameter::kColourReadout:
      return &CameraConfig::colour_readout_ms;
    case CameraParameter::kDepthReadout:
      return &CameraConfig::depth_readout_ms;
    case CameraParameter::kDepthDelay:
      return &CameraConfig::depth_delay_ms;
    default:
      return nullptr;
  }
}

struct Found {
  double value = 0;  // times as they are; the others as surplus over what was used
  double std = 0;
  [[nodiscard]] bool is_told(const Wanted& wanted) const { return std < wanted.told_std; }
  [[nodiscard]] bool differs_from(double in_use) const {
    return std::abs(value - in_use) > kSigmas * std;
  }
};
using Findings = std::array<Found, kWanted.size()>;

struct Calibration {
  RunOptions options;
  std::string write;
  Sequence sequence;
  SlamConfig config;
};

/// Tracks the recording with the given camera. @return nothing if it tells too little of any of it.
Result<std::optional<Findings>> track(const Calibration& calibration, const CameraConfig& camera,
                                      int round) {
  SessionOptions session;
  session.config = calibration.config;
  for (const Wanted& wanted : kWanted)
    session.config.tracking.calibrated.push_back(wanted.parameter);
  session.config.run.keep_trajectory = false;
  session.without_model = "--segmenter none or --segmenter masks:DIR";
  session.camera = camera;
  session.deterministic = true;
  session.may_fork = true;
  if (Status segmenter =
          choose_segmenter(calibration.options.segmenter, calibration.options.model, session);
      !segmenter)
    return segmenter.error();
  auto opened = open_session(std::move(session));
  if (!opened) return opened.error();

  Sequence sequence = calibration.sequence;
  sequence.camera = camera;
  FrameReaderConfig reading;
  reading.from = calibration.options.from;
  if (calibration.options.to > 0) reading.to = calibration.options.to;
  reading.depth = calibration.config.depth;
  FrameReader reader(std::move(sequence), reading);
  ProgressBar progress(reader.length(), is_quiet());
  std::optional<CameraEstimator::Estimate> estimate;
  int frames = 0;
  while (auto frame = reader.next()) {
    TrackResult result = opened->runner->process(*frame);
    if (result.camera_estimate) estimate = std::move(result.camera_estimate);
    progress.update(index((*frame)->id) + 1, "round " + std::to_string(round + 1));
    ++frames;
    if (StopSignal::received() != 0) return std::optional<Findings>();
  }
  if (frames == 0)
    return Error{ErrorKind::kInput, calibration.options.sequence + ": not one frame could be read"};
  if (!estimate) return std::optional<Findings>();
  Findings findings;
  for (std::size_t i = 0; i < kWanted.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    findings[i] = {estimate->value[k] / kWanted[i].per_unit,
                   std::hypot(estimate->std[k], estimate->systematic[k]) / kWanted[i].per_unit};
  }
  return std::optional(findings);
}

enum class Take { kAllTold, kDiffering };  // from what is in use

CameraConfig with_times(CameraConfig camera, const Findings& findings, Take take) {
  for (std::size_t i = 0; i < kWanted.size(); ++i)
    if (double CameraConfig::*time_ms = shutter_time(kWanted[i].parameter);
        time_ms != nullptr && findings[i].is_told(kWanted[i]) &&
        (take == Take::kAllTold || findings[i].differs_from(camera.*time_ms)))
      camera.*time_ms = std::clamp(findings[i].value, -kMostTime_ms, kMostTime_ms);
  camera.shutter_known = true;
  return camera;
}

/// The times to track with next: the depth's delay goes beyond what was found, for the map, whose
/// depths were delayed as well, hides most of it.
CameraConfig for_next_round(const CameraConfig& camera, const Findings& findings) {
  CameraConfig next = with_times(camera, findings, Take::kAllTold);
  next.depth_delay_ms =
      std::clamp(camera.depth_delay_ms + kDelayStep * (next.depth_delay_ms - camera.depth_delay_ms),
                 -kMostTime_ms, kMostTime_ms);
  return next;
}

void print(const CameraConfig& used, const std::string& source, const Findings& findings) {
  std::printf("%-18s %10s %10s %8s\n", "", "in use", "found", "+-");
  for (std::size_t i = 0; i < kWanted.size(); ++i) {
    const Wanted& wanted = kWanted[i];
    const double CameraConfig::*time_ms = shutter_time(wanted.parameter);
    const double in_use = time_ms != nullptr ? used.*time_ms : 0;
    const Found& found = findings[i];
    const char* verdict = !found.is_told(wanted)       ? "this motion does not tell"
                          : found.differs_from(in_use) ? "differs"
                                                       : "agrees";
    if (time_ms != nullptr) {
      std::printf("%-18s %10.2f %10.2f %8.2f %-4s %s\n", wanted.name, in_use, found.value,
                  found.std, wanted.unit, verdict);
    } else {
      std::printf("%-18s %10s %+10.2f %8.2f %-4s %s\n", wanted.name, "", found.value, found.std,
                  wanted.unit, verdict);
    }
  }
  print_text("In use: {}.\n",
             source.empty() ? "nothing is known, taken as global" : one_line(source));
  std::printf(
      "The scale of depth cannot be told by pictures alone. Times belong in the camera's file;\n"
      "focal length, centre and bias are what this recording would like to be changed.\n");
}

std::string camera_text(const CameraConfig& camera) {
  std::string text = "# shutter found by ygslam calibrate\n";
  std::array<char, 96> line{};
  for (const CameraKey& key : camera_keys()) {
    std::snprintf(line.data(), line.size(), "%s: %.9g\n", std::string(key.name).c_str(),
                  camera.*key.value);
    text += line.data();
  }
  std::snprintf(line.data(), line.size(), "width: %d\nheight: %d\n", camera.width, camera.height);
  text += line.data();
  if (!camera.ignored.empty()) {
    std::string list = ignored_text(camera);
    std::ranges::replace(list, ' ', ',');
    text += "ignore: [" + list + "]\n";
  }
  return text;
}

Status calibrate(Calibration& calibration) {
  RunOptions& options = calibration.options;
  if (options.model.empty() && options.segmenter.empty()) options.segmenter = "none";
  if (options.dynamic_mode.empty() && options.segmenter == "none")
    options.dynamic_mode = "geometry";
  auto settings = load_settings(options);
  if (!settings) return settings.error();
  calibration.config = std::move(*settings);
  auto sequence = open_sequence(options);
  if (!sequence) return sequence.error();
  calibration.sequence = std::move(*sequence);
  if (Status range = check_range(options, calibration.sequence); !range) return range;
  FileUses uses;
  uses.reads_sequence(options.sequence, calibration.sequence);
  uses.writes("--write", calibration.write);
  if (Status checked = uses.check(); !checked.ok()) return checked;
  std::optional<AtomicFile> file;  // whether it can be written is known before minutes of work
  if (!calibration.write.empty()) {
    auto created = AtomicFile::create(calibration.write);
    if (!created.ok()) return created.error();
    file = std::move(*created);
  }
  const CameraConfig& used = calibration.sequence.camera;
  CameraConfig camera = used;
  camera.shutter_known = true;
  Findings findings;
  for (int round = 0; round < kRounds; ++round) {
    const auto found = track(calibration, camera, round);
    if (!found) return found.error();
    if (StopSignal::received() != 0) return Ok{};
    if (!*found) {
      return Error{ErrorKind::kInput, options.sequence +
                                          ": too short, or the camera hardly moves: nothing can be "
                                          "told of it"};
    }
    findings = **found;
    camera = for_next_round(camera, findings);
  }
  print(used, calibration.sequence.shutter_source, findings);
  if (!file) return Ok{};
  if (!findings.front().is_told(kWanted.front())) {
    return Error{ErrorKind::kInput, options.sequence + ": does not tell colour_readout_ms: " +
                                        calibration.write + " is not written"};
  }
  Status written = file->write(camera_text(with_times(used, findings, Take::kDiffering)));
  if (written) written = file->commit();
  if (written) tell_written(calibration.write);
  return written;
}

}  // namespace

void add_calibrate_command(CLI::App& app, int& exit_code) {
  auto calibration = std::make_shared<Calibration>();
  CLI::App* command = app.add_subcommand(
      "calibrate", "Find out from a lively recording when the camera reads its rows");
  RunOptions& options = calibration->options;
  add_input_options(*command, options);
  add_range_options(*command, options);
  command
      ->add_option("--write", calibration->write,
                   "Camera file for --camera, with the times that were told")
      ->type_name("FILE.yaml");
  command->footer(
      "Turn the camera quickly up and down and from side to side for ten seconds or more, in a "
      "room\n"
      "with texture, best without people; then:\n"
      "  ygslam calibrate RECORDING --write camera.yaml\n"
      "  ygslam run RECORDING --camera camera.yaml --out out\n"
      "Prints each number with its standard deviation, from how far parts of the recording "
      "disagree,\n"
      "and says where the motion does not tell. See docs/camera.md.");
  command->callback([calibration, &exit_code] {
    StopSignal::watch();
    exit_code = exit_code_of(calibrate(*calibration));
  });
}

}  // namespace ygslam
