#include "io/calibration.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <set>

#include "core/log.hpp"
#include "io/camera_devices.hpp"
#include "io/camera_formats.hpp"
#include "io/ignored_pixels.hpp"
#include "io/image_file.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr std::array<CameraKey, 13> kKeys = {
    {{"fx", &CameraConfig::fx, true},
     {"fy", &CameraConfig::fy, true},
     {"cx", &CameraConfig::cx, true},
     {"cy", &CameraConfig::cy, true},
     {"k1", &CameraConfig::k1},
     {"k2", &CameraConfig::k2},
     {"p1", &CameraConfig::p1},
     {"p2", &CameraConfig::p2},
     {"k3", &CameraConfig::k3},
     {"depth_scale", &CameraConfig::depth_scale},
     {"colour_readout_ms", &CameraConfig::colour_readout_ms},
     {"depth_readout_ms", &CameraConfig::depth_readout_ms},
     {"depth_delay_ms", &CameraConfig::depth_delay_ms}}};
constexpr std::array<std::string_view, 2> kWholeKeys = {"width", "height"};
constexpr std::string_view kDeviceKey = "camera";
constexpr std::string_view kIgnoreKey = "ignore";

constexpr std::array<std::string_view, 3> kShutterKeys = {"colour_readout_ms", "depth_readout_ms",
                                                          "depth_delay_ms"};
constexpr double kMostReadout_ms = 200;  // of a camera with 5 frames a second

std::string shown(double value) {
  std::array<char, 32> buffer;  // the shortest form that reads back the same, whatever the locale
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), result.ptr};
}

class Faults {
 public:
  void require(double value, double low, double high, std::string_view key, std::string_view unit) {
    if (std::isfinite(value) && value >= low && value <= high) return;
    list.push_back({std::string(key), "must lie in " + shown(low) + " to " + shown(high) +
                                          std::string(unit) + ", is " + shown(value)});
  }
  std::vector<CameraFault> list;
};

void judge_against_size(const CameraConfig& c, Faults& faults) {
  const std::size_t before = faults.list.size();
  // 0.1 x the width is a field of view of 157 degrees, 20 x one of 3 degrees.
  faults.require(c.fx, 0.1 * c.width, 20.0 * c.width, "fx", " px for this image size");
  faults.require(c.fy, 0.1 * c.height, 20.0 * c.height, "fy", " px for this image size");
  faults.require(c.cx, 0, c.width, "cx", " px for this image size");
  faults.require(c.cy, 0, c.height, "cy", " px for this image size");
  if (faults.list.size() > before) return;
  const auto pixel = pixel_without_ray(c);
  if (!pixel) return;
  const auto used = std::find_if(kKeys.begin(), kKeys.end(), [&](const CameraKey& key) {
    return key.name.find_first_of("kp") == 0 && c.*key.value != 0;
  });
  faults.list.push_back({std::string(used->name),
                         "the distortion cannot be undone at pixel (" +
                             shown(std::floor(pixel->x())) + ", " + shown(std::floor(pixel->y())) +
                             "): it folds the image (are all of k1 k2 p1 p2 k3 given?)"});
}

Error config_error(const std::string& name, int line, const std::string& what) {
  const std::string where = line > 0 ? name + ":" + std::to_string(line) : name;
  return {ErrorKind::kConfig, where + ": " + what};
}

std::string unknown_key(std::string_view key) {
  if (parse_number(key))
    return "'" + printable(key) + "' is a number where a key is expected: write lines `fx 525.0`";
  std::vector<std::string_view> names(kWholeKeys.begin(), kWholeKeys.end());
  names.push_back(kDeviceKey);
  names.push_back(kIgnoreKey);
  for (const CameraKey& known : kKeys) names.push_back(known.name);
  const std::string_view nearest = nearest_word(key, names);
  return "unknown key '" + printable(key) + "'" +
         (nearest.empty() ? std::string() : ", did you mean '" + std::string(nearest) + "'?");
}

const CameraKey* find_key(std::string_view name) {
  const auto key = std::find_if(kKeys.begin(), kKeys.end(),
                                [&](const CameraKey& known) { return known.name == name; });
  return key == kKeys.end() ? nullptr : &*key;
}

// Puts one value in its place. @return what is wrong with it, empty if nothing.
std::string store(std::string_view name, std::string_view word, CameraConfig& camera) {
  const auto value = parse_number(word);
  if (!value) return "'" + printable(word) + "' is not a finite number";
  if (const CameraKey* key = find_key(name)) {
    camera.*key->value = *value;
    return {};
  }
  if (*value != std::floor(*value) || *value < 1 || *value > kMaxImageSide_px) {
    return "must be a whole number from 1 to " + std::to_string(kMaxImageSide_px) + ", is '" +
           printable(word) + "'";
  }
  (name == "width" ? camera.width : camera.height) = static_cast<int>(*value);
  return {};
}

}  // namespace

std::span<const CameraKey> camera_keys() { return kKeys; }

bool is_shutter_key(std::string_view key) {
  return std::find(kShutterKeys.begin(), kShutterKeys.end(), key) != kShutterKeys.end();
}

std::optional<CameraFault> apply_device(std::string_view name, CameraConfig& camera) {
  const CameraDevice* device = find_camera_device(name);
  if (device == nullptr && !name.empty()) {
    std::vector<std::string_view> names;
    for (const CameraDevice& known : camera_devices()) names.push_back(known.name);
    std::string list;
    for (const std::string_view known : names)
      list += (list.empty() ? "" : ", ") + std::string(known);
    return CameraFault{std::string(kDeviceKey), "'" + printable(name) + "' is none of " + list};
  }
  CameraConfig usual;
  if (device != nullptr) set_shutter(*device, camera.shutter_known ? usual : camera);
  for (const CameraKey& key : kKeys)
    if (double& value = camera.*key.value; is_shutter_key(key.name) && std::isnan(value))
      value = usual.*key.value;
  if (device == nullptr || !camera.shutter_known) return std::nullopt;
  const auto refuses = [&](const ImageShutter& known, double readout_ms) {
    return known.kind == ImageShutter::Kind::kGlobal && readout_ms != 0;
  };
  const std::string reason = "the " + std::string(device->title) + " takes this image at once";
  if (refuses(device->colour, camera.colour_readout_ms))
    return CameraFault{"colour_readout_ms", reason};
  if (refuses(device->depth, camera.depth_readout_ms))
    return CameraFault{"depth_readout_ms", reason};
  return std::nullopt;
}

void turn_y_down(CameraConfig& camera, const std::string& name) {
  if (!(camera.fy < 0) || camera.is_distorted()) return;
  camera.fy = -camera.fy;
  log::info(
      "{}: fy is below 0, a camera with y up (ICL-NUIM): read as fy {}; its truth is mirrored "
      "(eval "
      "--mirrored-truth)",
      name, shown(camera.fy));
}

std::vector<CameraFault> camera_faults(const CameraConfig& c) {
  Faults faults;
  faults.require(c.fx, 1, 1e6, "fx", " px");
  faults.require(c.fy, 1, 1e6, "fy", " px");
  faults.require(c.cx, -1e6, 1e6, "cx", " px");
  faults.require(c.cy, -1e6, 1e6, "cy", " px");
  // Generous bounds on Brown-Conrady coefficients; k3 multiplies r^6 and may be large where r <
  // 0.5.
  faults.require(c.k1, -10, 10, "k1", "");
  faults.require(c.k2, -100, 100, "k2", "");
  faults.require(c.p1, -1, 1, "p1", "");
  faults.require(c.p2, -1, 1, "p2", "");
  faults.require(c.k3, -1000, 1000, "k3", "");
  faults.require(c.depth_scale, 1e-3, 1e6, "depth_scale", " units per metre");
  faults.require(c.colour_readout_ms, -kMostReadout_ms, kMostReadout_ms, "colour_readout_ms", "");
  faults.require(c.depth_readout_ms, -kMostReadout_ms, kMostReadout_ms, "depth_readout_ms", "");
  faults.require(c.depth_delay_ms, -kMostReadout_ms, kMostReadout_ms, "depth_delay_ms", "");
  if (c.width < 0 || c.width > kMaxImageSide_px)
    faults.require(-1, 1, kMaxImageSide_px, "width", " px");
  if (c.height < 0 || c.height > kMaxImageSide_px)
    faults.require(-1, 1, kMaxImageSide_px, "height", " px");
  if (faults.list.empty() && c.width > 0 && c.height > 0) {
    judge_against_size(c, faults);
    if (const auto fault = ignored_fault(c))
      faults.list.push_back({std::string(kIgnoreKey), *fault});
  }
  return faults.list;
}

Result<CameraConfig> judged_foreign_camera(const Result<ForeignCamera>& foreign, double depth_scale,
                                           const std::string& name) {
  if (!foreign.ok()) return foreign.error();
  CameraConfig camera = foreign->camera;
  if (camera.depth_scale == 0) camera.depth_scale = depth_scale;
  const auto faults = camera_faults(camera);
  if (faults.empty()) return camera;
  return config_error(name, 0, faults.front().key + ": " + faults.front().reason);
}

Result<CameraConfig> parse_calibration(std::string_view text, const std::string& name,
                                       const std::filesystem::path& folder) {
  if (const auto foreign = parse_foreign_camera(text, name))
    return judged_foreign_camera(*foreign, CameraConfig{}.depth_scale, name);
  CameraConfig camera;
  camera.width = camera.height = 0;
  std::set<std::string_view> seen;
  std::string_view device;
  TextLine ignored;
  for (const TextLine& line : data_lines(text)) {
    const auto words = words_of(line.text.substr(0, line.text.find('#')), ":=");
    if (words.empty()) return config_error(name, line.number, "needs `key value`");
    const std::string_view key = words.front();
    const bool whole = std::find(kWholeKeys.begin(), kWholeKeys.end(), key) != kWholeKeys.end();
    if (key != kDeviceKey && key != kIgnoreKey && !whole && !find_key(key))
      return config_error(name, line.number, unknown_key(key));
    const std::string quoted = std::string(key) + ": ";
    if (words.size() != 2 && key != kIgnoreKey)
      return config_error(name, line.number, quoted + "needs one value");
    if (!seen.insert(key).second) return config_error(name, line.number, quoted + "given twice");
    if (key == kDeviceKey) {
      device = words[1];
      continue;
    }
    if (key == kIgnoreKey) {
      ignored = line;
      continue;
    }
    const std::string wrong = store(key, words[1], camera);
    if (!wrong.empty()) return config_error(name, line.number, quoted + wrong);
  }
  camera.shutter_known = std::any_of(seen.begin(), seen.end(), is_shutter_key);
  for (const CameraKey& key : kKeys)
    if (is_shutter_key(key.name) && !seen.contains(key.name))
      camera.*key.value = std::numeric_limits<double>::quiet_NaN();
  if (const auto fault = apply_device(device, camera))
    return config_error(name, calibration_line(text, fault->key),
                        fault->key + ": " + fault->reason);
  for (const CameraKey& key : kKeys) {
    if (key.required && !seen.contains(key.name)) {
      return config_error(name, 0, "missing key '" + std::string(key.name) + "'");
    }
  }
  turn_y_down(camera, name);
  // Last: the size of the images, if the file says it, is known.
  auto words = words_of(ignored.text.substr(0, ignored.text.find('#')), ":=[],");
  if (!words.empty()) words.erase(words.begin());
  if (const std::string wrong = read_ignored(words, folder, camera); !wrong.empty())
    return config_error(name, ignored.number, "ignore: " + wrong);
  const auto faults = camera_faults(camera);
  if (faults.empty()) return camera;
  return config_error(name, calibration_line(text, faults.front().key),
                      faults.front().key + ": " + faults.front().reason);
}

Result<CameraConfig> read_calibration(const std::filesystem::path& path) {
  const auto text = read_file(path, kLargestCameraFile_bytes);
  if (!text.ok()) return Error{ErrorKind::kConfig, text.error().message};
  if (const std::string fault = no_text_fault(*text); !fault.empty())
    return config_error(path.string(), 0, fault);
  return parse_calibration(*text, path.string(), folder_of(path));
}

std::string format_calibration(const CameraConfig& c) {
  std::string text;
  const auto line = [&](const char* key, double value) {
    std::array<char, 64> buffer{};
    std::snprintf(buffer.data(), buffer.size(), "%s %.10g\n", key, value);
    text += buffer.data();
  };
  line("fx", c.fx);
  line("fy", c.fy);
  line("cx", c.cx);
  line("cy", c.cy);
  if (c.is_distorted()) {
    line("k1", c.k1);
    line("k2", c.k2);
    line("p1", c.p1);
    line("p2", c.p2);
    line("k3", c.k3);
  }
  if (c.depth_scale > 0) line("depth_scale", c.depth_scale);
  if (c.shutter_known) {
    line("colour_readout_ms", c.colour_readout_ms);
    line("depth_readout_ms", c.depth_readout_ms);
    line("depth_delay_ms", c.depth_delay_ms);
  }
  if (c.width > 0 && c.height > 0) {  // else that of the images
    line("width", c.width);
    line("height", c.height);
  }
  if (!c.ignored.empty()) text += "ignore " + ignored_text(c) + "\n";
  return text;
}

int calibration_line(std::string_view text, std::string_view key) {
  for (const TextLine& line : data_lines(text)) {
    const auto words = words_of(line.text, ":=");
    if (!words.empty() && words.front() == key) return line.number;
  }
  return 0;
}

std::optional<CameraPreset> camera_preset(std::string_view folder_name) {
  // TUM: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats, in the precision of the
  // calibration files; the depth images are already corrected there.
  // Bonn: Palazzolo et al. 2019, https://www.ipb.uni-bonn.de/data/rgbd-dynamic-dataset/
  const std::array<std::pair<std::string_view, CameraPreset>, 4> kPresets = {{
      {"freiburg1",
       {"TUM freiburg1",
        {517.306408, 516.469215, 318.643040, 255.313989, 0.262383, -0.953104, -0.005358, 0.002628,
         1.163314, 640, 480, 5000}}},
      {"freiburg2",
       {"TUM freiburg2",
        {520.908620, 521.007327, 325.141442, 249.701764, 0.231222, -0.784899, -0.003257, -0.000105,
         0.917205, 640, 480, 5000}}},
      {"freiburg3", {"TUM freiburg3", {535.4, 539.2, 320.1, 247.6, 0, 0, 0, 0, 0, 640, 480, 5000}}},
      {"rgbd_bonn",
       {"Bonn",
        {542.822841, 542.576870, 315.593520, 237.756098, 0.039903, -0.099343, -0.000730, -0.000144,
         0, 640, 480, 5000}}},
  }};
  for (const auto& [part, preset] : kPresets) {
    if (folder_name.find(part) != std::string_view::npos) return preset;
  }
  return std::nullopt;
}

}  // namespace ygslam
