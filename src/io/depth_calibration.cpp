#include "io/depth_calibration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "core/log.hpp"
#include "io/calibration.hpp"
#include "io/camera_formats.hpp"
#include "io/fusion_info.hpp"
#include "io/json_text.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr std::string_view kPlacement = "T_colour_depth";
constexpr double kFarthest_m = 2;  // cameras of one device
constexpr double kNormTolerance = 0.01;

Error fault(const std::string& name, int line, const std::string& what) {
  const std::string where = line > 0 ? name + ":" + std::to_string(line) : name;
  return {ErrorKind::kConfig, where + ": " + what};
}

constexpr std::size_t kPlacementNumbers = 7;

/// @param line 0: none to name.
Result<SE3> placement_of(const std::array<double, kPlacementNumbers>& n, int line,
                         const std::string& name) {
  const auto refuse = [&](const std::string& what) {
    return fault(name, line, std::string(kPlacement) + ": " + what);
  };
  const Eigen::Quaterniond q(n[6], n[3], n[4], n[5]);
  const Vec3 t_m(n[0], n[1], n[2]);
  if (const std::string wrong = fault_of_placement(q, t_m); !wrong.empty()) return refuse(wrong);
  return SE3(q, t_m);
}

Result<SE3> parse_placement(const TextLine& line, const std::string& name) {
  const auto refuse = [&](const std::string& what) {
    return fault(name, line.number, std::string(kPlacement) + ": " + what);
  };
  const auto words = words_of(line.text.substr(0, line.text.find('#')), ":=[,]");
  std::array<double, kPlacementNumbers> n{};
  if (words.size() != 1 + n.size()) return refuse("needs tx ty tz qx qy qz qw");
  for (std::size_t i = 0; i < n.size(); ++i) {
    const auto value = parse_number(words[1 + i]);
    if (!value) return refuse("'" + printable(words[1 + i]) + "' is not a finite number");
    n[i] = *value;
  }
  return placement_of(n, line.number, name);
}

/// A key of JSON. @return nothing where there is none, or the text is no JSON.
Result<std::optional<SE3>> placement_in_json(std::string_view text, const std::string& name) {
  if (!trimmed(text.substr(0, 16)).starts_with('{')) return std::optional<SE3>();
  const auto json = parse_json(text, name);
  if (!json.ok() || !json->is_object()) return std::optional<SE3>();
  const auto found = json->find(kPlacement);
  if (found == json->end()) return std::optional<SE3>();
  std::array<double, kPlacementNumbers> n{};
  const bool is_list = found->is_array() && found->size() == n.size() &&
                       std::all_of(found->begin(), found->end(),
                                   [](const auto& value) { return value.is_number(); });
  if (!is_list) return fault(name, 0, std::string(kPlacement) + ": needs tx ty tz qx qy qz qw");
  for (std::size_t i = 0; i < n.size(); ++i) n[i] = (*found)[i].template get<double>();
  const auto placement = placement_of(n, 0, name);
  if (!placement.ok()) return placement.error();
  return std::optional(*placement);
}

/// A camera file of another program.
Result<DepthCamera> foreign_depth_camera(const ForeignCamera& foreign,
                                         const std::optional<SE3>& placement,
                                         const std::string& name) {
  DepthCamera depth{foreign.camera, placement.value_or(SE3())};
  CameraConfig judged = depth.camera;
  if (!foreign.says_depth_scale) depth.camera.depth_scale = 0;
  if (judged.depth_scale == 0) judged.depth_scale = 1;
  if (const auto faults = camera_faults(judged); !faults.empty())
    return fault(name, 0, faults.front().key + ": " + faults.front().reason);
  if (!placement)
    log::warn("{}: has no {}: the depth camera is taken to stand where the colour camera does",
              name, kPlacement);
  return depth;
}

}  // namespace

std::string fault_of_placement(const Eigen::Quaterniond& q_colour_depth,
                               const Vec3& t_colour_depth_m) {
  if (!(std::abs(q_colour_depth.norm() - 1) < kNormTolerance))
    return "the quaternion's length is not 1";
  if (!(t_colour_depth_m.norm() < kFarthest_m)) return "the cameras are more than 2 m apart";
  return {};
}

Result<DepthCamera> parse_depth_calibration(const std::string& text, const std::string& name) {
  if (const auto info = parse_fusion_info(text, name)) {
    if (!info->ok()) return info->error();
    if ((*info)->depth) return *(*info)->depth;
    return fault(name, 0, "tells of no depth camera");
  }
  std::string lens = text;  // without the line that calibration.txt does not know
  std::optional<SE3> T_colour_depth;
  for (const TextLine& line : data_lines(text)) {
    const auto words = words_of(line.text, ":=");
    if (words.empty()) continue;
    if (is_shutter_key(words.front()) || words.front() == "camera")
      return fault(name, line.number, printable(words.front()) + ": belongs in calibration.txt");
    if (words.front() != kPlacement) continue;
    if (T_colour_depth) return fault(name, line.number, std::string(kPlacement) + ": given twice");
    const auto placement = parse_placement(line, name);
    if (!placement.ok()) return placement.error();
    T_colour_depth = *placement;
    const auto begin = static_cast<std::size_t>(line.text.data() - text.data());
    lens.replace(begin, line.text.size(), line.text.size(), ' ');
  }
  const auto in_json = placement_in_json(lens, name);
  if (!in_json.ok()) return in_json.error();
  if (in_json.value()) T_colour_depth = *in_json.value();
  if (const auto foreign = parse_foreign_camera(lens, name)) {
    if (!foreign->ok()) return foreign->error();
    return foreign_depth_camera(**foreign, T_colour_depth, name);
  }
  auto camera = parse_calibration(lens, name);
  if (!camera.ok()) return camera.error();
  if (!T_colour_depth) return fault(name, 0, "missing key '" + std::string(kPlacement) + "'");
  if (calibration_line(lens, "depth_scale") == 0) camera->depth_scale = 0;
  return DepthCamera{*camera, *T_colour_depth};
}

Result<DepthCamera> read_depth_calibration(const std::filesystem::path& path) {
  const auto text = read_file(path, kLargestCameraFile_bytes);
  if (!text.ok()) return Error{ErrorKind::kConfig, text.error().message};
  if (const std::string found = no_text_fault(*text); !found.empty())
    return fault(path.string(), 0, found);
  return parse_depth_calibration(*text, path.string());
}

std::string format_depth_calibration(const DepthCamera& depth) {
  const Vec3& t = depth.T_colour_depth.t();
  const Eigen::Quaterniond q = depth.T_colour_depth.quaternion();
  std::array<char, 256> line{};
  std::snprintf(line.data(), line.size(), "%s %.10g %.10g %.10g %.10g %.10g %.10g %.10g\n",
                kPlacement.data(), t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  CameraConfig camera = depth.camera;
  camera.shutter_known = false;
  return format_calibration(camera) + line.data();
}

}  // namespace ygslam
