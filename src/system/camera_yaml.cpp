#include "system/camera_yaml.hpp"

#include <cmath>
#include <limits>

#include "io/calibration.hpp"
#include "io/text.hpp"
#include "system/config_schema.hpp"

namespace ygslam {

Result<CameraConfig> parse_camera_yaml(const std::string& text, const std::string& name) {
  CameraConfig camera;
  camera.width = camera.height = 0;
  for (const CameraKey& key : camera_keys())
    if (key.required) camera.*key.value = std::numeric_limits<double>::quiet_NaN();
  ConfigSchema schema;
  constexpr double kBig = 1e9;
  for (const CameraKey& key : camera_keys())
    schema.number(std::string(key.name), camera.*key.value, -kBig, kBig, "", "", "");
  schema.number("width", camera.width, 0, 1 << 20, "px", "", "");
  schema.number("height", camera.height, 0, 1 << 20, "px", "", "");
  Status loaded = schema.load_yaml_text(text, name);
  if (!loaded.ok()) return loaded.error();
  for (const CameraKey& key : camera_keys()) {
    if (std::isnan(camera.*key.value))
      return Error{ErrorKind::kConfig, name + ": " + std::string(key.name) + " is missing"};
  }
  if (const auto faults = camera_faults(camera); !faults.empty()) {
    const int line = calibration_line(text, faults.front().key);
    return Error{ErrorKind::kConfig, name + (line > 0 ? ":" + std::to_string(line) : "") + ": " +
                                         faults.front().key + ": " + faults.front().reason};
  }
  return camera;
}

Result<CameraConfig> read_camera_yaml(const std::string& path) {
  const auto text = read_file(path, std::size_t{1} << 20);
  if (!text.ok()) return Error{ErrorKind::kConfig, text.error().message};
  return parse_camera_yaml(*text, path);
}

}  // namespace ygslam
