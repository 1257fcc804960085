#include "io/camera_formats.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <vector>

#include "core/log.hpp"  // brings {fmt}
#include "io/camera_matrix.hpp"
#include "io/fusion_info.hpp"
#include "io/image_file.hpp"
#include "io/json_text.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr double kMillimetres = 1000;
using Foreign = std::optional<Result<ForeignCamera>>;

Error foreign_fault(const std::string& name, const std::string& what) {
  return {ErrorKind::kConfig, name + ": " + what};
}

ForeignCamera blank_camera(const std::string& taken_for) {
  ForeignCamera foreign;
  foreign.taken_for = taken_for;
  foreign.camera.width = foreign.camera.height = 0;
  foreign.camera.depth_scale = 0;
  return foreign;
}

bool set_side(double value, int& side_px) {
  if (!(value >= 1 && value <= kMaxImageSide_px) || value != static_cast<int>(value)) return false;
  side_px = static_cast<int>(value);
  return true;
}

void set_lens(CameraConfig& camera, double fx, double fy, double cx, double cy) {
  camera.fx = fx, camera.fy = fy, camera.cx = cx, camera.cy = cy;
}

/// k1 k2 p1 p2 [k3], as OpenCV and ROS order them.
void set_distortion(CameraConfig& camera, const std::vector<double>& values) {
  const std::array<double*, 5> places = {&camera.k1, &camera.k2, &camera.p1, &camera.p2,
                                         &camera.k3};
  for (std::size_t i = 0; i < std::min(values.size(), places.size()); ++i) *places[i] = values[i];
}

/// What four numbers without keys rather are than fx fy cx cy; empty where they may be these. A
/// camera's focal lengths are much alike: where two others are more so, it is another order.
std::string other_order(const std::vector<double>& n) {
  const auto unlike = [&](std::size_t i, std::size_t j) {
    return std::abs(std::log(std::abs(n[i]) / std::abs(n[j])));
  };
  constexpr double kAlike = 0.05;
  const double limit = 0.5 * unlike(0, 1);
  if (!std::isfinite(limit) || unlike(0, 1) < kAlike) return {};
  if (unlike(0, 2) < limit) return "fx cx fy cy";
  if (unlike(2, 3) < limit) return "cx cy fx fy";
  return {};
}

Foreign parse_bare_line(const std::vector<double>& numbers, const std::string& name) {
  if (const std::string order = other_order(numbers); !order.empty())
    return foreign_fault(
        name, fmt::format("{:g} {:g} {:g} {:g} without keys may be {} and not fx fy cx cy: write "
                          "lines `fx 525.0`",
                          numbers[0], numbers[1], numbers[2], numbers[3], order));
  ForeignCamera line = blank_camera("fx fy cx cy and distortion in one line");
  if (numbers.size() == 4) line.taken_for = "fx fy cx cy in one line";
  set_lens(line.camera, numbers[0], numbers[1], numbers[2], numbers[3]);
  set_distortion(line.camera, {numbers.begin() + 4, numbers.end()});
  return line;
}

/// Numbers alone: `fx fy cx cy [k1 k2 p1 p2 [k3]]`, or a 3x3 or 4x4 matrix.
Foreign parse_bare(std::string_view text, const std::string& name) {
  std::vector<double> numbers;
  const auto lines = data_lines(text);
  for (const TextLine& line : lines)
    for (const std::string_view word : words_of(line.text, ",;[]")) {
      const auto number = parse_number(word);
      if (!number) return std::nullopt;
      numbers.push_back(*number);
    }
  if (numbers.empty()) return std::nullopt;
  const std::size_t count = numbers.size();
  ForeignCamera matrix = blank_camera("a camera matrix");
  const std::string fault = set_camera_matrix(matrix.camera, numbers);
  if (fault.empty()) return matrix;
  const bool is_matrix = (count == 9 && lines.size() == 3) || count == 16;
  if (is_matrix) return foreign_fault(name, fault);
  if (count == 4 || count == 8 || count == 9) return parse_bare_line(numbers, name);
  return foreign_fault(name,
                       std::to_string(count) +
                           " numbers without keys: write `fx fy cx cy`, `fx fy cx cy k1 k2 p1 "
                           "p2 [k3]`, a 3x3 matrix, or lines `fx 525.0`");
}

/// Whether a line is indented. @param line a view into `text`.
bool is_indented(std::string_view text, std::string_view line) {
  const auto at = static_cast<std::size_t>(line.data() - text.data());
  return at > 0 && (text[at - 1] == ' ' || text[at - 1] == '\t');
}

/// `Key: value` lines of a YAML file; those below `Group:` are called Group.Key.
std::map<std::string, std::string, std::less<>> flat_yaml(std::string_view text) {
  std::map<std::string, std::string, std::less<>> values;
  std::string group;
  for (const TextLine& line : data_lines(text)) {
    const std::size_t colon = line.text.find(':');
    if (line.text.front() == '%' || colon == std::string_view::npos) continue;
    std::string_view value = line.text.substr(colon + 1);
    value = trimmed(value.substr(0, value.find('#')));
    if (value.size() >= 2 && (value.front() == '"' || value.front() == '\''))
      value = value.substr(1, value.size() - 2);
    std::string key(trimmed(line.text.substr(0, colon)));
    if (!is_indented(text, line.text)) {
      group = value.empty() ? key : std::string();
    } else if (!group.empty()) {
      key = group + "." + key;
    }
    values.emplace(std::move(key), value);
  }
  return values;
}

/// Settings of ORB-SLAM2, ORB-SLAM3 and stella_vslam: `Camera.fx`, or `Camera1.fx`.
Foreign parse_orb_settings(std::string_view text, const std::string& name) {
  const auto values = flat_yaml(text);
  const std::string prefix = values.contains("Camera1.fx") ? "Camera1." : "Camera.";
  if (!values.contains(prefix + "fx")) return std::nullopt;
  ForeignCamera foreign = blank_camera("settings of ORB-SLAM or stella_vslam");
  for (const char* key : {"Camera.type", "Camera.model"}) {
    const auto model = values.find(key);
    if (model == values.end()) continue;
    const std::string& word = model->second;
    if (word != "PinHole" && word != "Rectified" && word != "perspective")
      return foreign_fault(name, std::string(key) + ": '" + printable(word) +
                                     "' is not read: only PinHole and perspective");
  }
  std::string wrong;
  const auto number = [&](const std::string& key) -> std::optional<double> {
    const auto found = values.find(key);
    if (found == values.end()) return std::nullopt;
    const auto value = parse_number(found->second);
    if (!value && wrong.empty())
      wrong = key + ": '" + printable(found->second) + "' is not a finite number";
    return value;
  };
  CameraConfig& camera = foreign.camera;
  const std::array<std::pair<const char*, double*>, 9> keys = {{{"fx", &camera.fx},
                                                                {"fy", &camera.fy},
                                                                {"cx", &camera.cx},
                                                                {"cy", &camera.cy},
                                                                {"k1", &camera.k1},
                                                                {"k2", &camera.k2},
                                                                {"p1", &camera.p1},
                                                                {"p2", &camera.p2},
                                                                {"k3", &camera.k3}}};
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const auto value = number(prefix + keys[i].first);
    if (value) *keys[i].second = *value;
    if (!value && i < 4 && wrong.empty()) wrong = "missing key '" + prefix + keys[i].first + "'";
  }
  for (const auto& [key, side] : {std::pair{"Camera.width", &camera.width},
                                  {"Camera.cols", &camera.width},
                                  {"Camera.height", &camera.height},
                                  {"Camera.rows", &camera.height}})
    if (const auto value = number(key); value && !set_side(*value, *side) && wrong.empty())
      wrong = std::string(key) + ": is no size of an image";
  for (const char* key : {"DepthMapFactor", "RGBD.DepthMapFactor", "depthmap_factor",
                          "Camera.depthmap_factor", "Preprocessing.depthmap_factor"})
    if (const auto value = number(key)) {
      if (!(*value > 0) && wrong.empty())
        wrong = fmt::format("{}: must be above 0, is {:g}", key, *value);
      camera.depth_scale = *value;
      foreign.says_depth_scale = true;
    }
  if (!wrong.empty()) return foreign_fault(name, wrong);
  return foreign;
}

/// The numbers in brackets behind a key and, where it has one, its `data`.
std::optional<std::vector<double>> numbers_behind(std::string_view text, std::string_view key) {
  for (std::size_t at = text.find(key); at != std::string_view::npos; at = text.find(key, at + 1)) {
    const bool starts = at == 0 || text[at - 1] == '\n';
    if (!starts || !trimmed(text.substr(at + key.size(), 2)).starts_with(':')) continue;
    const std::size_t begin = text.find('[', at);
    const std::size_t end = text.find(']', at);
    if (begin == std::string_view::npos || end == std::string_view::npos || end < begin) return {};
    std::vector<double> numbers;
    for (const std::string_view word : words_of(text.substr(begin + 1, end - begin - 1), ",\r\n")) {
      const auto number = parse_number(word);
      if (!number) return {};
      numbers.push_back(*number);
    }
    return numbers;
  }
  return {};
}

/// ROS camera_info as calibrators write it, or as `topic echo` shows it; OpenCV's calibrations.
Foreign parse_camera_info(std::string_view text, const std::string& name) {
  auto matrix = numbers_behind(text, "camera_matrix");
  for (const char* key : {"K", "k"})
    if (!matrix) matrix = numbers_behind(text, key);
  if (!matrix) return std::nullopt;
  ForeignCamera foreign = blank_camera("camera_info of ROS");
  foreign.camera.depth_scale = kMillimetres;
  if (const std::string fault = set_camera_matrix(foreign.camera, *matrix); !fault.empty())
    return foreign_fault(name, "camera_matrix: " + fault);
  const auto values = flat_yaml(text);
  const auto model = values.find("distortion_model");
  auto distortion = numbers_behind(text, "distortion_coefficients");
  for (const char* key : {"D", "d"})
    if (!distortion) distortion = numbers_behind(text, key);
  const std::vector<double> d = distortion.value_or(std::vector<double>());
  const bool is_plumb_bob = model == values.end() || model->second.empty() ||
                            model->second == "plumb_bob" || model->second == "rational_polynomial";
  const bool fits = std::all_of(d.begin() + std::min<std::ptrdiff_t>(5, std::ssize(d)), d.end(),
                                [](double value) { return value == 0; });
  if (!is_plumb_bob || !fits)
    return foreign_fault(name, "distortion_model: '" +
                                   printable(model == values.end() ? "" : model->second) +
                                   "' is not read: only plumb_bob");
  set_distortion(foreign.camera, d);
  for (const auto& [key, side] : {std::pair{"image_width", &foreign.camera.width},
                                  {"width", &foreign.camera.width},
                                  {"image_height", &foreign.camera.height},
                                  {"height", &foreign.camera.height}})
    if (const auto found = values.find(key); found != values.end())
      if (!set_side(parse_number(found->second).value_or(0), *side))
        return foreign_fault(name, std::string(key) + ": is no size of an image");
  return foreign;
}

/// JSON with intrinsic_matrix (Open3D, by columns), ppx (RealSense) or fl_x (nerfstudio).
Foreign parse_json_camera(std::string_view text, const std::string& name) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::size_t brace = text.find_first_not_of(kBlanks);
  if (brace == std::string_view::npos || text[brace] != '{') return std::nullopt;
  const auto json = parse_json(text, name);
  if (!json.ok()) {
    // Our own keys in YAML's braces, too, may begin so.
    const std::size_t key = text.find_first_not_of(kBlanks, brace + 1);
    if (key == std::string_view::npos || text[key] != '"') return std::nullopt;
    return foreign_fault(
        name, "begins as JSON and is none: " + json.error().message.substr(name.size() + 2));
  }
  const auto number = [&](const char* key) -> std::optional<double> {
    const auto found = json->find(key);
    if (found == json->end() || !found->is_number()) return std::nullopt;
    return found->get<double>();
  };
  const auto numbers = [&](const char* key) {
    std::vector<double> values;
    const auto found = json->find(key);
    if (found != json->end() && found->is_array())
      for (const auto& value : *found)
        if (value.is_number()) values.push_back(value.get<double>());
    return values;
  };
  const auto word = [&](const char* key) {
    const auto found = json->find(key);
    return found != json->end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  ForeignCamera foreign = blank_camera("");
  CameraConfig& camera = foreign.camera;
  camera.depth_scale = kMillimetres;
  const auto four = [&](const char* fx, const char* fy, const char* cx, const char* cy) {
    const auto a = number(fx), b = number(fy), c = number(cx), d = number(cy);
    if (a && b && c && d) set_lens(camera, *a, *b, *c, *d);
    return a && b && c && d;
  };
  if (const auto m = numbers("intrinsic_matrix"); m.size() == 9) {
    foreign.taken_for = "intrinsics of Open3D";
    const bool is_by_rows = m[2] != 0 && m[5] != 0 && m[6] == 0 && m[7] == 0;
    const std::string fault =
        is_by_rows ? "is row by row; Open3D writes column by column"
                   : set_camera_matrix(
                         camera, std::array{m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]});
    if (!fault.empty()) return foreign_fault(name, "intrinsic_matrix: " + fault);
  } else if (four("fx", "fy", "ppx", "ppy")) {
    foreign.taken_for = "intrinsics of RealSense";
    const auto d = numbers("coeffs");
    const bool is_zero = std::ranges::all_of(d, [](double value) { return value == 0; });
    const std::string model = word("model");
    if (!is_zero &&
        (model.find("nverse") != std::string::npos || model.find("brown") == std::string::npos))
      return foreign_fault(name,
                           "model: '" + printable(model) + "' is not read: only Brown-Conrady");
    set_distortion(camera, d);
  } else if (four("fl_x", "fl_y", "cx", "cy")) {
    foreign.taken_for = "transforms.json of nerfstudio";
    const std::string model = word("camera_model");
    if (!model.empty() && model != "OPENCV" && model != "PINHOLE")
      return foreign_fault(
          name, "camera_model: '" + printable(model) + "' is not read: only OPENCV and PINHOLE");
    set_distortion(camera,
                   {number("k1").value_or(0), number("k2").value_or(0), number("p1").value_or(0),
                    number("p2").value_or(0), number("k3").value_or(0)});
  } else if (number("fx")) {
    return std::nullopt;  // our own keys
  } else {
    return foreign_fault(name,
                         "JSON without a camera that is read: intrinsic_matrix (Open3D), fx fy "
                         "ppx ppy (RealSense), or fl_x fl_y cx cy (nerfstudio)");
  }
  for (const auto& [key, side] : {std::pair{"width", &camera.width},
                                  {"w", &camera.width},
                                  {"height", &camera.height},
                                  {"h", &camera.height}})
    if (const auto value = number(key); value && !set_side(*value, *side))
      return foreign_fault(name, std::string(key) + ": is no size of an image");
  return foreign;
}

/// info.txt of BundleFusion.
Foreign parse_fusion_camera(std::string_view text, const std::string& name) {
  const auto info = parse_fusion_info(text, name);
  if (!info) return std::nullopt;
  if (!info->ok()) return info->error();
  ForeignCamera foreign = blank_camera("info.txt of BundleFusion");
  foreign.camera = (*info)->colour;
  foreign.says_depth_scale = true;
  return foreign;
}

}  // namespace

bool has_json_camera(const std::filesystem::path& path) {
  std::error_code code;
  if (!std::filesystem::is_regular_file(path, code)) return false;
  const auto text = read_file(path, kLargestCameraFile_bytes);
  return text.ok() &&
         std::ranges::any_of(std::array{"\"intrinsic_matrix\"", "\"ppx\"", "\"fl_x\""},
                             [&](const char* key) { return text->find(key) != std::string::npos; });
}

std::string foreign_camera_note(const std::string& path, double depth_scale) {
  const auto text = read_file(path, kLargestCameraFile_bytes);
  if (!text.ok()) return {};
  const auto foreign = parse_foreign_camera(*text, path);
  if (!foreign || !foreign->ok()) return {};
  std::array<char, 32> scale{};
  std::snprintf(scale.data(), scale.size(), "%g", depth_scale);
  return path + " is taken for " + (*foreign)->taken_for + ", " + scale.data() +
         " units of depth per metre";
}

Foreign parse_foreign_camera(std::string_view text, const std::string& name) {
  for (const auto parse :
       {parse_fusion_camera, parse_json_camera, parse_bare, parse_orb_settings, parse_camera_info})
    if (Foreign found = parse(text, name)) return found;
  return std::nullopt;
}

}  // namespace ygslam
