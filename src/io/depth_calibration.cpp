#include "io/depth_calibration.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "io/calibration.hpp"
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

Result<SE3> parse_placement(const TextLine& line, const std::string& name) {
  constexpr std::size_t kNumbers = 7;
  const auto refuse = [&](const std::string& what) {
    return fault(name, line.number, std::string(kPlacement) + ": " + what);
  };
  const auto words = words_of(line.text.substr(0, line.text.find('#')), ":=[,]");
  if (words.size() != 1 + kNumbers) return refuse("needs tx ty tz qx qy qz qw");
  std::array<double, kNumbers> n{};
  for (std::size_t i = 0; i < kNumbers; ++i) {
    const auto value = parse_number(words[1 + i]);
    if (!value) return refuse("'" + printable(words[1 + i]) + "' is not a finite number");
    n[i] = *value;
  }
  const Eigen::Quaterniond q(n[6], n[3], n[4], n[5]);
  const Vec3 t_m(n[0], n[1], n[2]);
  if (const std::string wrong = fault_of_placement(q, t_m); !wrong.empty()) return refuse(wrong);
  return SE3(q, t_m);
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
  auto camera = parse_calibration(lens, name);
  if (!camera.ok()) return camera.error();
  if (!T_colour_depth) return fault(name, 0, "missing key '" + std::string(kPlacement) + "'");
  if (calibration_line(lens, "depth_scale") == 0) camera->depth_scale = 0;
  return DepthCamera{*camera, *T_colour_depth};
}

Result<DepthCamera> read_depth_calibration(const std::filesystem::path& path) {
  const auto text = read_file(path, std::size_t{1} << 20);
  if (!text.ok()) return Error{ErrorKind::kConfig, text.error().message};
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
