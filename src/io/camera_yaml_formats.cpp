// Camera files in YAML, of SLAM programs and of calibrators.
#include <algorithm>
#include <array>

#include "core/log.hpp"  // brings {fmt}
#include "io/camera_matrix.hpp"
#include "io/foreign_camera.hpp"
#include "io/text.hpp"

namespace ygslam::foreign_camera {
namespace {

/// Why a camera's picture is not that of its lens; empty where it is.
std::string unread_camera_info(const FlatYaml& yaml) {
  for (const char* key : {"binning_x", "binning_y"})
    if (parse_number(yaml.value(key)).value_or(0) > 1)
      return std::string(key) + ": is of a binned image, which is not read";
  for (const char* key : {"roi.x_offset", "roi.y_offset"})
    if (yaml.is_not_0(key)) return std::string(key) + ": is of a cut image, which is not read";
  const std::string fisheye = yaml.value("fisheye_model");
  if (!fisheye.empty() && fisheye != "0" && fisheye != "false")
    return "fisheye_model: is not read: only plumb_bob";
  if (yaml.values.contains("xi")) return "xi: an omnidirectional camera is not read";
  return {};
}

}  // namespace

Foreign parse_orb_settings(std::string_view text, const std::string& name) {
  const FlatYaml yaml = flat_yaml(text);
  const auto& values = yaml.values;
  const std::string prefix = values.contains("Camera1.fx") ? "Camera1." : "Camera.";
  if (!values.contains(prefix + "fx")) return std::nullopt;
  if (prefix == "Camera1." && values.contains("Camera.fx") &&
      yaml.value("Camera.fx") != yaml.value("Camera1.fx"))
    return fault(name, "has both Camera.fx and Camera1.fx: which camera is it?");
  ForeignCamera foreign = blank("settings of ORB-SLAM or stella_vslam");
  for (const char* key : {"Camera.type", "Camera.model"}) {
    const auto model = values.find(key);
    if (model == values.end()) continue;
    const std::string& word = model->second;
    if (word != "PinHole" && word != "Rectified" && word != "perspective")
      return fault(name, std::string(key) + ": '" + printable(word) +
                             "' is not read: only PinHole and perspective");
  }
  std::string wrong;
  const auto number = [&](const std::string& key) -> std::optional<double> {
    const auto found = values.find(key);
    if (found == values.end()) return std::nullopt;
    if (yaml.contradicted.contains(key) && wrong.empty()) wrong = key + ": given twice";
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
  for (const char* key : {"k4", "k5", "k6"})
    if (yaml.is_not_0(prefix + key) && wrong.empty())
      wrong = prefix + key + ": is not read; of the terms of distortion k1 k2 p1 p2 k3 are";
  if (!wrong.empty()) return fault(name, wrong);
  return foreign;
}

Foreign parse_camera_info(std::string_view text, const std::string& name) {
  auto matrix = numbers_behind(text, "camera_matrix");
  for (const char* key : {"K", "k"})
    if (!matrix) matrix = numbers_behind(text, key);
  if (!matrix) return std::nullopt;
  ForeignCamera foreign = blank("camera_info of ROS");
  foreign.camera.depth_scale = kMillimetres;
  if (matrix->empty()) return fault(name, "camera_matrix: has no numbers, or two kinds");
  if (const std::string wrong = set_camera_matrix(foreign.camera, *matrix); !wrong.empty())
    return fault(name, "camera_matrix: " + wrong);
  const FlatYaml yaml = flat_yaml(text);
  if (const std::string wrong = unread_camera_info(yaml); !wrong.empty()) return fault(name, wrong);
  const std::string model = yaml.value("distortion_model");
  auto distortion = numbers_behind(text, "distortion_coefficients");
  for (const char* key : {"D", "d"})
    if (!distortion) distortion = numbers_behind(text, key);
  const std::vector<double> d = distortion.value_or(std::vector<double>());
  const bool is_plumb_bob = model.empty() || model == "plumb_bob" || model == "rational_polynomial";
  const bool fits = std::all_of(d.begin() + std::min<std::ptrdiff_t>(5, std::ssize(d)), d.end(),
                                [](double value) { return value == 0; });
  if (!is_plumb_bob)
    return fault(name, "distortion_model: '" + printable(model) + "' is not read: only plumb_bob");
  if (!fits)
    return fault(name, "distortion_coefficients: has more terms than the five of plumb_bob");
  set_distortion(foreign.camera, d);
  for (const auto& [key, side] : {std::pair{"image_width", &foreign.camera.width},
                                  {"width", &foreign.camera.width},
                                  {"image_height", &foreign.camera.height},
                                  {"height", &foreign.camera.height}})
    if (const auto found = yaml.values.find(key); found != yaml.values.end())
      if (!set_side(parse_number(found->second).value_or(0), *side))
        return fault(name, std::string(key) + ": is no size of an image");
  return foreign;
}

Foreign parse_kalibr(std::string_view text, const std::string& name) {
  const FlatYaml yaml = flat_yaml(text);
  const bool is_of_kalibr = yaml.values.contains("cam0.intrinsics");
  if (!is_of_kalibr &&
      !(yaml.values.contains("intrinsics") && yaml.values.contains("camera_model")))
    return std::nullopt;
  const std::string prefix = is_of_kalibr ? "cam0." : "";
  if (yaml.values.contains("cam1.intrinsics"))
    return fault(name, "tells of several cameras: keep the lines of the colour camera as cam0");
  ForeignCamera foreign = blank(is_of_kalibr ? "a camchain of Kalibr" : "sensor.yaml of EuRoC");
  foreign.camera.depth_scale = kMillimetres;
  const std::string model = yaml.value(prefix + "camera_model");
  const std::string lens = yaml.value(prefix + "distortion_model");
  if (model != "pinhole")
    return fault(name, "camera_model: '" + printable(model) + "' is not read: only pinhole");
  if (lens != "radtan" && lens != "radial-tangential" && lens != "none")
    return fault(name, "distortion_model: '" + printable(lens) + "' is not read: only radtan");
  const auto f = yaml.numbers(prefix + "intrinsics");
  if (!f || f->size() != 4) return fault(name, "intrinsics: are not four numbers fu fv cu cv");
  set_lens(foreign.camera, (*f)[0], (*f)[1], (*f)[2], (*f)[3]);
  for (const char* key : {"distortion_coeffs", "distortion_coefficients"})
    if (const auto terms = yaml.numbers(prefix + key)) set_distortion(foreign.camera, *terms);
  const auto size = yaml.numbers(prefix + "resolution");
  if (size && (size->size() != 2 || !set_side((*size)[0], foreign.camera.width) ||
               !set_side((*size)[1], foreign.camera.height)))
    return fault(name, "resolution: is no size of an image");
  return foreign;
}

Foreign parse_vins(std::string_view text, const std::string& name) {
  const FlatYaml yaml = flat_yaml(text);
  if (!yaml.values.contains("model_type")) return std::nullopt;
  if (const std::string model = yaml.value("model_type"); model != "PINHOLE")
    return fault(name, "model_type: '" + printable(model) + "' is not read: only PINHOLE");
  ForeignCamera foreign = blank("a camera of VINS");
  CameraConfig& camera = foreign.camera;
  camera.depth_scale = kMillimetres;
  std::string wrong;
  const auto number = [&](const std::string& key) {
    const auto value = parse_number(yaml.value(key));
    if (!value) wrong = key + ": is missing, or no finite number";
    return value.value_or(0);
  };
  const std::string lens = "projection_parameters.", terms = "distortion_parameters.";
  set_lens(camera, number(lens + "fx"), number(lens + "fy"), number(lens + "cx"),
           number(lens + "cy"));
  set_distortion(camera, {number(terms + "k1"), number(terms + "k2"), number(terms + "p1"),
                          number(terms + "p2")});
  for (const auto& [key, side] :
       {std::pair{"image_width", &camera.width}, {"image_height", &camera.height}})
    if (yaml.values.contains(key) && !set_side(number(key), *side))
      wrong = std::string(key) + ": is no size of an image";
  if (!wrong.empty()) return fault(name, wrong);
  return foreign;
}

Foreign parse_neural(std::string_view text, const std::string& name) {
  const FlatYaml yaml = flat_yaml(text);
  const std::string prefix =
      yaml.values.contains("cam.png_depth_scale") ? "cam." : "camera_params.";
  if (!yaml.values.contains(prefix + "png_depth_scale")) return std::nullopt;
  ForeignCamera foreign = blank("settings of NICE-SLAM or SplaTAM");
  CameraConfig& camera = foreign.camera;
  std::string wrong;
  const auto number = [&](const char* key) {
    const auto value = parse_number(yaml.value(prefix + key));
    if (!value) wrong = prefix + key + ": is missing, or no finite number";
    return value.value_or(0);
  };
  set_lens(camera, number("fx"), number("fy"), number("cx"), number("cy"));
  camera.depth_scale = number("png_depth_scale");
  foreign.says_depth_scale = true;
  for (const auto& [key, side] : {std::pair{"W", &camera.width},
                                  {"image_width", &camera.width},
                                  {"H", &camera.height},
                                  {"image_height", &camera.height}})
    if (yaml.values.contains(prefix + key) && !set_side(number(key), *side))
      wrong = prefix + key + ": is no size of an image";
  if (const auto terms = yaml.numbers(prefix + "distortion")) set_distortion(camera, *terms);
  if (!wrong.empty()) return fault(name, wrong);
  return foreign;
}

}  // namespace ygslam::foreign_camera
