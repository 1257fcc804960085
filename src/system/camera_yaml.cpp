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
  Status loaded = schema.load_yaml_text(text, name);
  if (!loaded.ok()) return loaded.error();
  for (const auto& [key, value] :
       {std::pair{"fx", camera.fx}, {"fy", camera.fy}, {"cx", camera.cx}, {"cy", camera.cy}}) {
    if (std::isnan(value)) return Error{ErrorKind::kConfig, name + ": " + key + " is missing"};
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
