#include "io/sensor_yaml.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/log.hpp"
#include "io/text.hpp"
#include "io/trajectory_checks.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kLargestSensorYaml_bytes = std::size_t{1} << 20;

Error yaml_fault(const std::string& name, int line, const std::string& what) {
  const std::string where = line > 0 ? name + ":" + std::to_string(line) : name;
  return {ErrorKind::kConfig, where + ": " + what};
}

std::string unknown_key(std::string_view key, const SensorYaml& yaml) {
  std::vector<std::string_view> names = {yaml.pose_key};
  for (const SensorKey& known : yaml.keys) names.push_back(known.name);
  const std::string_view nearest = nearest_word(key, names);
  return "unknown key '" + printable(key) + "'" +
         (nearest.empty() ? std::string() : ", did you mean '" + std::string(nearest) + "'?");
}

/// `[x, y, z, qx, qy, qz, qw]`. @return what is wrong, empty if nothing.
std::string store_pose(std::string_view value, SE3& pose) {
  const auto words = words_of(value, ",[]");
  constexpr std::size_t kPoseNumbers = 7;
  std::array<double, kPoseNumbers> v{};
  if (words.size() != kPoseNumbers)
    return fmt::format("{} numbers, not 7: [x, y, z, qx, qy, qz, qw]", words.size());
  for (std::size_t i = 0; i < v.size(); ++i) {
    const auto number = parse_number(words[i]);
    if (!number) return "'" + printable(words[i]) + "' is not a finite number";
    v[i] = *number;
  }
  const Vec3 t(v[0], v[1], v[2]);
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
  if (!(std::abs(q.norm() - 1) < kQuaternionTolerance))
    return fmt::format("quaternion of length {:.3g}, not 1", q.norm());
  if (!(t.cwiseAbs().maxCoeff() <= kMostLever_m))
    return "farther than 100 m from the camera (metres are expected)";
  pose = SE3(q, t);
  return {};
}

}  // namespace

std::string store_sensor_number(const SensorKey& key, std::string_view word, double& place) {
  const auto number = parse_number(word);
  if (!number) return fmt::format("{}: '{}' is not a finite number", key.name, printable(word));
  if (*number < key.least || *number > key.most)
    return fmt::format("{} must lie in {:g} to {:g} ({}), is {:g}", key.name, key.least, key.most,
                       key.unit, *number);
  place = *number;
  return {};
}

Result<std::vector<bool>> parse_sensor_yaml(std::string_view text, const std::string& name,
                                            const SensorYaml& yaml) {
  for (const Status& status : {check_is_text(text, name), check_line_ends(text, name)})
    if (!status.ok()) return Error{ErrorKind::kConfig, status.error().message};
  std::vector<bool> seen(yaml.keys.size() + 1);  // the last is the pose
  for (const TextLine& line : data_lines(text)) {
    if (line.text == "---" || line.text == "%YAML:1.0") continue;
    const std::size_t colon = line.text.find(':');
    if (colon == std::string_view::npos)
      return yaml_fault(name, line.number, "a line 'key: value' is expected");
    const std::string_view key = trimmed(line.text.substr(0, colon));
    std::string_view value = line.text.substr(colon + 1);
    value = trimmed(value.substr(0, value.find('#')));
    const auto known = std::ranges::find(yaml.keys, key, &SensorKey::name);
    const auto index = static_cast<std::size_t>(known - yaml.keys.begin());
    const bool is_pose = key == yaml.pose_key;
    if (known == yaml.keys.end() && !is_pose)
      return yaml_fault(name, line.number, unknown_key(key, yaml));
    if (seen[index])
      return yaml_fault(name, line.number, "'" + std::string(key) + "' is given twice");
    seen[index] = true;
    const std::string fault = is_pose ? store_pose(value, *yaml.pose)
                                      : store_sensor_number(*known, value, *yaml.values[index]);
    if (!fault.empty()) return yaml_fault(name, line.number, fault);
  }
  for (std::size_t i = 0; i < yaml.keys.size(); ++i)
    if (yaml.keys[i].required && !seen[i])
      return yaml_fault(name, 0, "'" + std::string(yaml.keys[i].name) + "' is missing");
  if (!seen.back()) return yaml_fault(name, 0, "'" + std::string(yaml.pose_key) + "' is missing");
  return seen;
}

Result<std::string> read_sensor_yaml(const std::string& path) {
  auto text = read_file(path, kLargestSensorYaml_bytes);
  if (!text.ok()) return Error{ErrorKind::kConfig, text.error().message};
  return text;
}

std::string format_sensor_number(const SensorKey& key, double value) {
  return fmt::format("{}: {}  # [{}]\n", key.name, value, key.unit);
}

std::string format_sensor_pose(std::string_view key, const SE3& pose, std::string_view what) {
  const Vec3& t = pose.t();
  const Eigen::Quaterniond q = pose.quaternion();
  return fmt::format("{}: [{}, {}, {}, {}, {}, {}, {}]  # x y z [m] qx qy qz qw, {}\n", key, t.x(),
                     t.y(), t.z(), q.x(), q.y(), q.z(), q.w(), what);
}

}  // namespace ygslam
