#include "io/camera_formats.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <vector>

#include "core/log.hpp"  // brings {fmt}
#include "io/camera_matrix.hpp"
#include "io/foreign_camera.hpp"
#include "io/fusion_info.hpp"
#include "io/json_text.hpp"
#include "io/text.hpp"

namespace ygslam {
using namespace foreign_camera;  // NOLINT(google-build-using-namespace): its own parts

namespace {

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
    return fault(
        name, fmt::format("{:g} {:g} {:g} {:g} without keys may be {} and not fx fy cx cy: write "
                          "lines `fx 525.0`",
                          numbers[0], numbers[1], numbers[2], numbers[3], order));
  ForeignCamera line = blank("fx fy cx cy and distortion in one line");
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
  ForeignCamera matrix = blank("a camera matrix");
  const std::string wrong = set_camera_matrix(matrix.camera, numbers);
  if (wrong.empty()) return matrix;
  const bool is_matrix = (count == 9 && lines.size() == 3) || count == 16;
  if (is_matrix) return fault(name, wrong);
  if (count == 4 || count == 8 || count == 9) return parse_bare_line(numbers, name);
  return fault(name, std::to_string(count) +
                         " numbers without keys: write `fx fy cx cy`, `fx fy cx cy k1 k2 p1 "
                         "p2 [k3]`, a 3x3 matrix, or lines `fx 525.0`");
}

/// RealSense's plain model, OpenCV's; the modified one differs in the tangential terms.
bool is_brown_conrady(std::string model, const std::vector<double>& terms) {
  if (std::ranges::all_of(terms, [](double value) { return value == 0; })) return true;
  std::ranges::transform(model, model.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool is_tangential = terms.size() > 3 && (terms[2] != 0 || terms[3] != 0);
  return model.find("brown") != std::string::npos && model.find("inverse") == std::string::npos &&
         !(is_tangential && model.find("modified") != std::string::npos);
}

/// Whether a frame of nerfstudio's transforms.json has a focal length of its own.
bool has_other_lens(const nlohmann::json& json, double fx) {
  const auto frames = json.find("frames");
  if (frames == json.end() || !frames->is_array()) return false;
  return std::ranges::any_of(*frames, [fx](const nlohmann::json& frame) {
    const auto own = frame.is_object() ? frame.find("fl_x") : frame.end();
    return own != frame.end() && own->is_number() && std::abs(own->get<double>() - fx) > 0.5;
  });
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
    return fault(name,
                 "begins as JSON and is none: " + json.error().message.substr(name.size() + 2));
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
  ForeignCamera foreign = blank("");
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
    const std::string wrong =
        is_by_rows ? "is row by row; Open3D writes column by column"
                   : set_camera_matrix(
                         camera, std::array{m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]});
    if (!wrong.empty()) return fault(name, "intrinsic_matrix: " + wrong);
  } else if (four("fx", "fy", "ppx", "ppy")) {
    foreign.taken_for = "intrinsics of RealSense";
    const auto d = numbers("coeffs");
    const std::string model = word("model");
    if (!is_brown_conrady(model, d))
      return fault(name, "model: '" + printable(model) + "' is not read: only Brown-Conrady");
    set_distortion(camera, d);
  } else if (four("fl_x", "fl_y", "cx", "cy")) {
    foreign.taken_for = "transforms.json of nerfstudio";
    const std::string model = word("camera_model");
    if (!model.empty() && model != "OPENCV" && !model.ends_with("PINHOLE"))
      return fault(name,
                   "camera_model: '" + printable(model) + "' is not read: only OPENCV and PINHOLE");
    if (json->value("is_fisheye", nlohmann::json()) == true)
      return fault(name, "is_fisheye: is not read: only OPENCV and PINHOLE");
    if (number("k4").value_or(0) != 0)
      return fault(name, "k4: is not read; of the terms of distortion k1 k2 p1 p2 k3 are");
    if (has_other_lens(*json, camera.fx))
      return fault(name, "frames: have lenses of their own, which are not read");
    set_distortion(camera,
                   {number("k1").value_or(0), number("k2").value_or(0), number("p1").value_or(0),
                    number("p2").value_or(0), number("k3").value_or(0)});
  } else if (number("fx")) {
    return std::nullopt;  // our own keys
  } else {
    return fault(name,
                 "JSON without a camera that is read: intrinsic_matrix (Open3D), fx fy "
                 "ppx ppy (RealSense), or fl_x fl_y cx cy (nerfstudio)");
  }
  for (const char* key : {"depth_scale", "depth_unit_scale_factor", "integer_depth_scale"})
    if (const auto value = number(key)) {
      if (!(*value > 0))
        return fault(name, fmt::format("{}: must be above 0, is {:g}", key, *value));
      // Metres for a unit, or units for a metre.
      camera.depth_scale = *value < 1 ? 1 / *value : *value;
      foreign.says_depth_scale = true;
    }
  for (const auto& [key, side] : {std::pair{"width", &camera.width},
                                  {"w", &camera.width},
                                  {"height", &camera.height},
                                  {"h", &camera.height}})
    if (const auto value = number(key); value && !set_side(*value, *side))
      return fault(name, std::string(key) + ": is no size of an image");
  return foreign;
}

/// info.txt of BundleFusion.
Foreign parse_fusion_camera(std::string_view text, const std::string& name) {
  const auto info = parse_fusion_info(text, name);
  if (!info) return std::nullopt;
  if (!info->ok()) return info->error();
  ForeignCamera foreign = blank("info.txt of BundleFusion");
  foreign.camera = (*info)->colour;
  foreign.says_depth_scale = true;
  return foreign;
}

/// One line of COLMAP's cameras.txt: `id MODEL width height parameters`.
Result<ForeignCamera> colmap_camera(const std::vector<std::string_view>& words,
                                    const std::string& name) {
  ForeignCamera foreign = blank("cameras.txt of COLMAP");
  CameraConfig& camera = foreign.camera;
  camera.depth_scale = kMillimetres;
  std::vector<double> p;
  for (std::size_t i = 2; i < words.size(); ++i) {
    const auto number = parse_number(words[i]);
    if (!number) return fault(name, "'" + printable(words[i]) + "' is not a finite number");
    p.push_back(*number);
  }
  constexpr std::array<std::pair<std::string_view, std::size_t>, 5> kModels = {
      {{"SIMPLE_PINHOLE", 3}, {"PINHOLE", 4}, {"SIMPLE_RADIAL", 4}, {"RADIAL", 5}, {"OPENCV", 8}}};
  const std::string_view model = words[1];
  const auto* const known =
      std::ranges::find(kModels, model, [](const auto& m) { return m.first; });
  if (known == kModels.end() || p.size() != 2 + known->second)
    return fault(name, "camera model '" + printable(model) +
                           "' is not read: only PINHOLE, SIMPLE_PINHOLE, SIMPLE_RADIAL, RADIAL and "
                           "OPENCV with their parameters");
  if (!set_side(p[0], camera.width) || !set_side(p[1], camera.height))
    return fault(name, "is of no size of an image");
  const bool has_two = model == "PINHOLE" || model == "OPENCV";
  const std::size_t centre = has_two ? 4 : 3;
  // Coordinates begin at the corner of the first pixel, ours in its middle.
  set_lens(camera, p[2], p[centre - 1], p[centre] - 0.5, p[centre + 1] - 0.5);
  set_distortion(camera, {p.begin() + static_cast<std::ptrdiff_t>(centre) + 2, p.end()});
  return foreign;
}

Foreign parse_colmap(std::string_view text, const std::string& name) {
  const auto lines = data_lines(text);
  Foreign camera;
  for (const TextLine& line : lines) {
    const auto words = words_of(line.text);
    const bool is_camera =
        words.size() > 4 && parse_number(words[0]) &&
        std::ranges::all_of(words[1], [](char c) { return (c >= 'A' && c <= 'Z') || c == '_'; });
    if (!is_camera) return std::nullopt;
    if (camera) return fault(name, "tells of several cameras: keep the line of one");
    camera = colmap_camera(words, name);
  }
  return camera;
}

/// A camera file, but of none of the formats that are read.
Foreign refuse_others(std::string_view text, const std::string& name) {
  const std::string_view begin = trimmed(text.substr(0, 200));
  if (begin.starts_with("%YAML"))
    return fault(name,
                 "is YAML of OpenCV without a camera that is read (camera_matrix, Camera.fx; "
                 "docs/inputs.md)");
  if (begin.starts_with("<"))
    return fault(name, "is XML, which is not read; OpenCV writes YAML, too");
  return std::nullopt;
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
       {parse_fusion_camera, parse_json_camera, parse_bare, parse_colmap, parse_orb_settings,
        parse_camera_info, parse_kalibr, parse_vins, parse_neural, refuse_others})
    if (Foreign found = parse(text, name)) return found;
  return std::nullopt;
}

}  // namespace ygslam
