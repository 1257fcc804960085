#include "app/run_options.hpp"

#include <CLI/CLI.hpp>

#include "app/motion_input.hpp"
#include "app/option_checks.hpp"
#include "app/stop_signal.hpp"
#include "bag/bag.hpp"
#include "bag/ros_images.hpp"
#include "bag/stream_sequence.hpp"
#include "io/depth_calibration.hpp"
#include "io/image_folders.hpp"
#include "io/text.hpp"
#include "system/camera_yaml.hpp"

namespace ygslam {
namespace {

constexpr std::string_view kSocket = "unix:";

bool is_stream(const std::string& sequence) {
  return sequence == "-" || sequence.starts_with(kSocket);
}

bool interrupted() { return StopSignal::received() != 0; }

Result<Sequence> open_stream(const RunOptions& options, const GivenCameras& cameras) {
  if (!options.may_stream)
    return Error{ErrorKind::kUsage, options.sequence + ": streams are for run and localize only"};
  if (!options.background_dir.empty())
    return Error{ErrorKind::kUsage, "--background reads its input twice, which a stream is not"};
  auto bytes = options.sequence == "-"
                   ? ByteStream::standard_input(interrupted)
                   : ByteStream::unix_socket(options.sequence.substr(kSocket.size()), interrupted);
  if (!bytes.ok()) return bytes.error();
  return open_stream_sequence(std::move(bytes).value(), options.topics, cameras,
                              wanted_motion(options));
}

constexpr const char* kInput = "Input";
constexpr const char* kSettings = "Settings";
constexpr const char* kWritten = "What is written";

constexpr int kMostPairs = 1'000'000'000;

/// @param type what --help calls the value.
template <typename T>
CLI::Option* add(CLI::App& command, const char* group, const char* name, T& value, const char* type,
                 const char* help) {
  return command.add_option(name, value, help)->type_name(type)->group(group);
}
CLI::Option* add_switch(CLI::App& command, const char* group, const char* name, bool& value,
                        const char* help) {
  return command.add_flag(name, value, help)->group(group);
}

void add_out_option(CLI::App& command, RunOptions& o) {
  command.add_option("--out", o.out_dir, "Folder for the results")->required()->type_name("DIR");
}

void add_motion_options(CLI::App& command, RunOptions& o) {
  add(command, kInput, "--imu", o.imu, "FILE|TOPIC|none",
      "Readings of the camera's IMU: a file or a topic of the bag (default: imu.csv of the folder, "
      "if imu.yaml is there; of a bag none)");
  add(command, kInput, "--imu-calibration", o.imu_calibration, "FILE.yaml|tf",
      "Where the IMU is on the camera and its noise: a file with T_camera_imu and densities "
      "(docs/outputs.md), one of Kalibr, or `tf`, as /tf_static says, with usual noise (default: "
      "imu.yaml of the folder, `tf` of a bag or stream)");
  add(command, kInput, "--odometry", o.odometry, "FILE|TOPIC|none",
      "What the robot's wheels tell (default: odom.csv of the folder, if odom.yaml is there)");
  add(command, kInput, "--odometry-calibration", o.odometry_calibration, "FILE.yaml|tf",
      "Where the camera is on the robot: a file with T_base_camera (docs/outputs.md), or `tf`, as "
      "/tf_static says (default: odom.yaml of the folder, `tf` of a bag or stream)");
}

void add_run_options(CLI::App& command, RunOptions& o) {
  add_motion_options(command, o);
  add_range_options(command, o);
  add(command, kInput, "--stride", o.stride, "N", "Every n-th pair")
      ->check(in_range(1, 1'000'000))
      ->capture_default_str();
  add_switch(command, kInput, "--realtime", o.realtime,
             "Feed frames at their stamps, drop when late");
  add(command, kSettings, "--dynamic", o.dynamic_mode, "off|geometry|semantic|full",
      "off: everything is static; geometry: epipolar check; semantic: masks; full: both (default)");
  add_switch(command, kSettings, "--deterministic", o.deterministic,
             "One schedule: same input, same bytes (masks come 2 frames late, but for builtin)")
      ->excludes("--realtime");
  add_switch(command, kWritten, "--covariance", o.covariance,
             "Covariances in trajectory_live.txt, and odometry.txt: poses in the frame that never "
             "jumps");
  add(command, kWritten, "--debug-images", o.debug_dir, "DIR",
      "Draw masks and labelled points here");
  add(command, kWritten, "--debug-every", o.debug_every, "N", "Draw every n-th frame")
      ->check(in_range(1, 1'000'000))
      ->capture_default_str();
  add(command, kWritten, "--save-masks", o.masks_dir, "DIR",
      "Keep what the network says here: runs with --segmenter masks:DIR need none");
}

void add_recording_options(CLI::App& command, RunOptions& o) {
  add(command, kWritten, "--mcap", o.mcap, "FILE",
      "Record what is seen and found, for Foxglove, Lichtblick, Rerun (docs/live.md)");
  add(command, kWritten, "--trace", o.trace, "FILE",
      "What each thread did when, for https://ui.perfetto.dev (docs/outputs.md)");
}

}  // namespace

void add_range_options(CLI::App& command, RunOptions& o) {
  add(command, kInput, "--from", o.from, "N", "First pair")
      ->check(in_range(0, kMostPairs))
      ->capture_default_str();
  add(command, kInput, "--to", o.to, "N", "One past the last pair (default: all)")
      ->check(in_range(1, kMostPairs));
}

void add_input_options(CLI::App& command, RunOptions& o) {
  command
      .add_option("SEQUENCE", o.sequence,
                  o.may_stream ? "Folder of images, bag, - for an MCAP stream on standard input, "
                                 "unix:SOCKET (docs/inputs.md)"
                               : "Folder of images or bag (docs/inputs.md)")
      ->required();
  add(command, kInput, "--model", o.model, "FILE",
      "Segmentation network, .onnx or .xml: YOLO, RTMDet-Ins, RF-DETR-Seg (docs/models.md)");
  add(command, kInput, "--segmenter", o.segmenter, kSegmenterType, kSegmenterHelp)
      ->default_str(segmenter_name(kDefaultSegmenter));
  add(command, kInput, "--camera", o.camera_file, "FILE.yaml",
      "Camera file in place of calibration.txt or CameraInfo");
  add(command, kInput, "--depth-camera", o.depth_camera_file, "FILE",
      "Depth has a camera of its own: lens and place, as calibration_depth.txt (docs/inputs.md)");
  add(command, kInput, "--rgb-topic", o.topics.rgb, "TOPIC",
      "Colour images of a bag that has several");
  add(command, kInput, "--depth-topic", o.topics.depth, "TOPIC",
      "Depth images of a bag that has several");
  add(command, kSettings, "--config", o.config_file, "FILE.yaml", "Settings (see `ygslam config`)");
  add(command, kSettings, "--set", o.sets, "KEY=VALUE", "One setting; may be repeated");
  add(command, kSettings, "--seed", o.seed, "N",
      "Start of all random sequences (default: run.seed)")
      ->check(in_range(std::uint64_t{0}, std::uint64_t{1} << 53U));
}

void declare_run_options(CLI::App& command, RunOptions& o) {
  o.may_stream = true;
  add_out_option(command, o);
  add_input_options(command, o);
  add(command, kInput, "--load-map", o.load_map, "FILE", "Go on with the map of an earlier run");
  add_run_options(command, o);
  add(command, kWritten, "--save-map", o.save_map, "FILE",
      "Keep the map in this file while it grows; replaces a map that is there, unless --load-map "
      "names it, too (docs/maps.md)");
  add_recording_options(command, o);
  add(command, kWritten, "--export", o.export_dir, "DIR",
      "Write the static scene here: mesh, cloud, OctoMap, ground plan (docs/exports.md)");
  add(command, kWritten, "--background", o.background_dir, "DIR",
      "After the run, write the recording here once more without what moves in it "
      "(docs/dense-map.md)");
  add_view_options(command, o.view);
  command.footer(
      "Examples:\n"
      "  ygslam run rgbd_dataset_freiburg3_walking_xyz --out out\n"
      "  ygslam run SEQ --out out --model yolov8n-seg.onnx    # a network that knows more than "
      "people\n"
      "  ygslam run SEQ --out out --dynamic geometry          # no network: motion alone\n"
      "  ygslam run SEQ --out out --segmenter masks:SEQ/mask  # recorded masks\n"
      "Writes trajectory.txt, trajectory_live.txt, keyframes.txt, frames.csv, objects.csv,\n"
      "loops.csv, map.ply, metrics.json, config.yaml, log.txt. Exit codes: 0 ok, 2 usage, 3 "
      "settings or camera, 4 input, 5 model, 6 map file,\n"
      "7 lost for more than run.max_lost_share, 9 output not written, 129/130/143 interrupted "
      "(saved).");
}

void declare_localize_options(CLI::App& command, RunOptions& o) {
  o.may_stream = true;
  add_out_option(command, o);
  add_input_options(command, o);
  command.add_option("--map", o.load_map, "Map of an earlier run (--save-map); stays as it is")
      ->required()
      ->type_name("FILE");
  add_run_options(command, o);
  add_recording_options(command, o);
  add_view_options(command, o.view);
  command.footer(
      "Example:\n"
      "  ygslam run MONDAY --out mapped --save-map office.ygmap --model yolov8n-seg.onnx\n"
      "  ygslam localize TUESDAY --map office.ygmap --out localized --model yolov8n-seg.onnx\n"
      "Poses are in the frame of the map. Until the place is recognised frames are lost.\n"
      "Writes trajectory.txt, trajectory_live.txt, frames.csv, objects.csv, loops.csv, "
      "metrics.json,\nconfig.yaml, log.txt. Exit codes as of run; 6 where the map is damaged, "
      "empty or of another camera.");
}

Result<SlamConfig> load_settings(const RunOptions& options) {
  SlamConfig config;
  ConfigSchema schema = schema_of(config);
  ConfigFaults faults;
  if (!options.config_file.empty()) faults.add(schema.load_yaml(options.config_file));
  for (const std::string& assignment : options.sets) {
    const auto equals = assignment.find('=');
    if (equals == std::string::npos) {
      faults.add("--set " + printable(assignment) + ": write key=value");
      continue;
    }
    faults.add(schema.set(assignment.substr(0, equals), assignment.substr(equals + 1), "--set"));
  }
  if (!options.dynamic_mode.empty()) {
    Status set = schema.set("dynamic.mode", options.dynamic_mode, "--dynamic");
    if (!set.ok()) return Error{ErrorKind::kUsage, set.error().message};
  }
  if (options.seed) config.run.seed = *options.seed;
  faults.add(validate(config));
  if (Status status = faults.status(); !status.ok()) return status.error();
  return resolved(std::move(config));
}

Result<Sequence> open_sequence(const RunOptions& options) {
  const bool is_stream = ygslam::is_stream(options.sequence);
  const bool is_bag = is_stream || ygslam::is_bag(options.sequence);
  if (!is_bag && !(options.topics.rgb + options.topics.depth).empty())
    return Error{ErrorKind::kUsage,
                 "--rgb-topic, --depth-topic: " + options.sequence + " is no bag"};
  GivenCameras cameras;
  if (!options.camera_file.empty()) {
    auto read = is_bag ? read_camera_yaml(options.camera_file, ros::kMillimetres)
                       : read_camera_yaml(options.camera_file);
    if (!read.ok()) return read.error();
    cameras.colour = *read;
    cameras.colour_source = options.camera_file;
  }
  if (!options.depth_camera_file.empty()) {
    auto read = read_depth_calibration(options.depth_camera_file);
    if (!read.ok()) return read.error();
    cameras.depth = *read;
    cameras.depth_source = options.depth_camera_file;
  }
  if (is_stream) return open_stream(options, cameras);
  if (is_bag) return open_bag_sequence(options.sequence, options.topics, cameras, interrupted);
  return open_folder_sequence(options.sequence, cameras);
}

Status check_range(const RunOptions& o, const Sequence& sequence) {
  if (sequence.stream && (o.to == 0 || o.to > o.from)) return Ok{};
  if (o.from < sequence.pairs.size() && (o.to == 0 || o.to > o.from)) return Ok{};
  const std::string to = o.to > 0 ? " --to " + std::to_string(o.to) : "";
  return Error{
      ErrorKind::kUsage,
      "--from " + std::to_string(o.from) + to + ": no frame" +
          (sequence.stream ? std::string() : " of the " + std::to_string(sequence.pairs.size()))};
}

}  // namespace ygslam
