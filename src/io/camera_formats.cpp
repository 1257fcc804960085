#include "io/camera_formats.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <vector>

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

/// Row by row; nothing where it is no matrix of a camera.
bool set_matrix(CameraConfig& camera, const std::vector<double>& m) {
  const std::size_t side = m.size() == 16 ? 4 : 3;
  if (m.size() != 9 && m.size() != 16) return false;
  const auto at = [&](std::size_t row, std::size_t column) { return m[row * side + column]; };
  if (at(0, 1) != 0 || at(1, 0) != 0 || at(2, 0) != 0 || at(2, 1) != 0 || at(2, 2) != 1)
    return false;
  set_lens(camera, at(0, 0), at(1, 1), at(0, 2), at(1, 2));
  return true;
}

/// Numbers alone: `fx fy cx cy [k1 k2 p1 p2 [k3]]`, or a 3x3 or 4x4 matrix.
Foreign parse_bare(std::string_view text, const std::string& name) {
  std::vector<double> numbers;
  for (const TextLine& line : data_lines(text))
    for (const std::string_view word : words_of(line.text, ",;[]")) {
      const auto number = parse_number(word);
      if (!number) return std::nullopt;
      numbers.push_back(*number);
    }
  if (numbers.empty()) return std::nullopt;
  if (ForeignCamera matrix = blank_camera("a camera matrix"); set_matrix(matrix.camera, numbers))
    return matrix;
  if (numbers.size() == 4 || numbers.size() == 8 || numbers.size() == 9) {
    ForeignCamera line = blank_camera("fx fy cx cy and distortion in one line");
    if (numbers.size() == 4) line.taken_for = "fx fy cx cy in one line";
    set_lens(line.camera, numbers[0], numbers[1], numbers[2], numbers[3]);
    set_distortion(line.camera, {numbers.begin() + 4, numbers.end()});
    return line;
  }
  return foreign_fault(name,
                       std::to_string(numbers.size()) +
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
  if (!set_matrix(foreign.camera, *matrix))
    return foreign_fault(name, "camera_matrix: is no 3x3 matrix of a camera");
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
  const std::string_view begin = trimmed(text.substr(0, 16));
  if (begin.empty() || begin.front() != '{') return std::nullopt;
  const auto json = parse_json(text, name);
  if (!json.ok()) return std::nullopt;  // YAML, too, may begin so
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
    if (!set_matrix(camera, {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}))
      return foreign_fault(name, "intrinsic_matrix: is none of a camera, column by column");
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

std::string foreign_camera_note(const std::string& path, double depth_scale) {
  const auto text = read_file(path, std::size_t{1} << 20);
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
