#include "system/camera_yaml.hpp"

#include <cmath>
#include <limits>

#include "io/calibration.hpp"
#include "io/camera_formats.hpp"
#include "io/ignored_pixels.hpp"
#include "io/text.hpp"
#include "system/config_schema.hpp"

namespace ygslam {

Result<CameraConfig> parse_camera_yaml(const std::string& text, const std::string& name,
                                       double depth_scale, const std::filesystem::path& folder) {
  if (const auto foreign = parse_foreign_camera(text, name))
    return judged_foreign_camera(*foreign, depth_scale, name);
  if (text.find(':') == std::string::npos) {  // lines `fx 525.0`, as in calibration.txt
    auto lines = parse_calibration(text, name, folder);
    if (lines.ok() && calibration_line(text, "depth_scale") == 0) lines->depth_scale = depth_scale;
    return lines;
  }
  CameraConfig camera;
  camera.depth_scale = depth_scale;
  camera.width = camera.height = 0;
  for (const CameraKey& key : camera_keys())
    if (key.required || is_shutter_key(key.name))
      camera.*key.value = std::numeric_limits<double>::quiet_NaN();
  ConfigSchema schema;
  constexpr double kBig = 1e9;
  for (const CameraKey& key : camera_keys())
    schema.number(std::string(key.name), camera.*key.value, -kBig, kBig, "", "", "");
  schema.number("width", camera.width, 0, 1 << 20, "px", "", "");
  schema.number("height", camera.height, 0, 1 << 20, "px", "", "");
  std::vector<std::string> device, ignored;
  schema.words("camera", device, "", "");
  schema.words("ignore", ignored, "", "");
  Status loaded = schema.load_yaml_text(text, name);
  if (!loaded.ok()) return loaded.error();
  for (const CameraKey& key : camera_keys()) {
    const bool is_given = !std::isnan(camera.*key.value);
    if (is_shutter_key(key.name)) {
      camera.shutter_known |= is_given;
    } else if (!is_given) {
      return Error{ErrorKind::kConfig, name + ": " + std::string(key.name) + " is missing"};
    }
  }
  const auto refusal = [&](const CameraFault& fault) {
    const int line = calibration_line(text, fault.key);
    return Error{ErrorKind::kConfig, name + (line > 0 ? ":" + std::to_string(line) : "") + ": " +
                                         fault.key + ": " + fault.reason};
  };
  if (device.size() > 1) return refusal({"camera", "needs one name"});
  if (const auto fault = apply_device(device.empty() ? "" : device.front(), camera))
    return refusal(*fault);
  turn_y_down(camera, name);
  const std::vector<std::string_view> words(ignored.begin(), ignored.end());
  if (const std::string wrong = read_ignored(words, folder, camera); !wrong.empty())
    return refusal({"ignore", wrong});
  if (const auto faults = camera_faults(camera); !faults.empty()) return refusal(faults.front());
  return camera;
}

Result<CameraConfig> read_camera_yaml(const std::string& path, double depth_scale) {
  const auto text = read_file(path, kLargestCameraFile_bytes);
  if (!text.ok()) return Error{ErrorKind::kConfig, text.error().message};
  if (const std::string fault = no_text_fault(*text); !fault.empty())
    return Error{ErrorKind::kConfig, path + ": " + fault};
  return parse_camera_yaml(*text, path, depth_scale, folder_of(path));
}

}  // namespace ygslam
