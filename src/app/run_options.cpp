#include "app/run_options.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <limits>

#include "io/calibration.hpp"
#include "io/text.hpp"

namespace ygslam {

void add_input_options(CLI::App& command, RunOptions& o) {
  command.add_option("SEQUENCE", o.sequence, "Folder in TUM RGB-D layout")->required();
  command.add_option("--model", o.model, "YOLOv8-seg network, .onnx or .xml")->type_name("FILE");
  command.add_option("--segmenter", o.segmenter, "Where masks come from")
      ->type_name("model|none|masks:DIR")
      ->capture_default_str();
  command.add_option("--camera", o.camera_file, "Camera file in place of calibration.txt")
      ->type_name("FILE.yaml");
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

Result<CameraConfig> read_camera_yaml(const std::string& path) {
  CameraConfig camera;
  camera.width = camera.height = 0;
  constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
  camera.fx = camera.fy = camera.cx = camera.cy = kMissing;
  ConfigSchema schema;
  constexpr double kBig = 1e9;
  for (auto [key, field] : {std::pair{"fx", &camera.fx},
                            {"fy", &camera.fy},
                            {"cx", &camera.cx},
                            {"cy", &camera.cy},
                            {"k1", &camera.k1},
                            {"k2", &camera.k2},
                            {"p1", &camera.p1},
                            {"p2", &camera.p2},
                            {"k3", &camera.k3},
                            {"depth_scale", &camera.depth_scale}}) {
    schema.number(key, *field, -kBig, kBig, "", "", "");
  }
  schema.number("width", camera.width, 0, 1 << 20, "px", "", "");
  schema.number("height", camera.height, 0, 1 << 20, "px", "", "");
  Status loaded = schema.load_yaml(path);
  if (!loaded.ok()) return loaded.error();
  for (const auto& [key, value] :
       {std::pair{"fx", camera.fx}, {"fy", camera.fy}, {"cx", camera.cx}, {"cy", camera.cy}}) {
    if (std::isnan(value)) return Error{ErrorKind::kConfig, path + ": " + key + " is missing"};
  }
  if (const auto faults = camera_faults(camera); !faults.empty()) {
    const auto text = read_file(path);
    const int line = text.ok() ? calibration_line(*text, faults.front().key) : 0;
    return Error{ErrorKind::kConfig, path + (line > 0 ? ":" + std::to_string(line) : "") + ": " +
                                         faults.front().key + ": " + faults.front().reason};
  }
  return camera;
}

Result<TumSequence> open_sequence(const RunOptions& options) {
  std::optional<CameraConfig> camera;
  if (!options.camera_file.empty()) {
    auto read = read_camera_yaml(options.camera_file);
    if (!read.ok()) return read.error();
    camera = *read;
  }
  auto sequence = open_tum_sequence(options.sequence, camera);
  if (!sequence.ok() && camera && sequence.error().kind == ErrorKind::kConfig)
    return Error{ErrorKind::kConfig, options.camera_file + ": " + sequence.error().message};
  return sequence;
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
