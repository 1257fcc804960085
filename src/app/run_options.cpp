#include "app/run_options.hpp"

#include <CLI/CLI.hpp>

#include "bag/bag.hpp"
#include "bag/ros_images.hpp"
#include "io/image_folders.hpp"
#include "io/text.hpp"
#include "system/camera_yaml.hpp"

namespace ygslam {

void add_input_options(CLI::App& command, RunOptions& o) {
  command.add_option("SEQUENCE", o.sequence, "Folder of images or bag (docs/inputs.md)")
      ->required();
  command.add_option("--model", o.model, "YOLOv8-seg network, .onnx or .xml")->type_name("FILE");
  command.add_option("--segmenter", o.segmenter, "Where masks come from")
      ->type_name("model|none|masks:DIR")
      ->capture_default_str();
  command
      .add_option("--camera", o.camera_file,
                  "Camera file in place of calibration.txt or CameraInfo")
      ->type_name("FILE.yaml");
  command.add_option("--rgb-topic", o.topics.rgb, "Colour images of a bag that has several")
      ->type_name("TOPIC");
  command.add_option("--depth-topic", o.topics.depth, "Depth images of a bag that has several")
      ->type_name("TOPIC");
  command.add_option("--config", o.config_file, "Settings (see `ygslam config`)")
      ->type_name("FILE.yaml");
  command.add_option("--set", o.sets, "One setting; may be repeated")->type_name("KEY=VALUE");
  command.add_option("--seed", o.seed, "Start of all random sequences")
      ->check(CLI::Range(0.0, 9007199254740992.0))
      ->type_name("N");
}

Status load_settings(const RunOptions& options, SlamConfig& config) {
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
  return faults.status();
}

Result<Sequence> open_sequence(const RunOptions& options) {
  const bool is_bag = ygslam::is_bag(options.sequence);
  if (!is_bag && !(options.topics.rgb + options.topics.depth).empty())
    return Error{ErrorKind::kUsage,
                 "--rgb-topic, --depth-topic: " + options.sequence + " is no bag"};
  std::optional<CameraConfig> camera;
  if (!options.camera_file.empty()) {
    auto read = is_bag ? read_camera_yaml(options.camera_file, ros::kMillimetres)
                       : read_camera_yaml(options.camera_file);
    if (!read.ok()) return read.error();
    camera = *read;
  }
  auto sequence = is_bag ? open_bag_sequence(options.sequence, options.topics, camera)
                         : open_folder_sequence(options.sequence, camera);
  if (!sequence.ok() && camera && sequence.error().kind == ErrorKind::kConfig)
    return Error{ErrorKind::kConfig, options.camera_file + ": " + sequence.error().message};
  return sequence;
}

Status check_range(const RunOptions& o, const Sequence& sequence) {
  if (o.from < sequence.pairs.size() && (o.to == 0 || o.to > o.from)) return Ok{};
  return Error{ErrorKind::kUsage, "--from " + std::to_string(o.from) + " --to " +
                                      std::to_string(o.to) + ": no frame of the " +
                                      std::to_string(sequence.pairs.size())};
}

Status parse_segmenter(const RunOptions& options, SessionOptions& session) {
  session.model = options.model;
  if (options.segmenter == "model") {
    session.segmenter = SegmenterKind::kModel;
  } else if (options.segmenter == "none") {
    session.segmenter = SegmenterKind::kNone;
  } else if (options.segmenter.starts_with("masks:") && options.segmenter.size() > 6) {
    session.segmenter = SegmenterKind::kMasks;
    session.masks_dir = options.segmenter.substr(6);
  } else {
    return Error{ErrorKind::kUsage,
                 "--segmenter " + options.segmenter + ": write model, none or masks:DIR"};
  }
  return Ok{};
}

}  // namespace ygslam
