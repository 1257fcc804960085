#include "io/trajectory.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "core/log.hpp"
#include "io/text.hpp"
#include "io/trajectory_checks.hpp"

namespace ygslam {
namespace {

// One line's pose, or what is wrong with it.
Result<StampedPose> parse_pose(std::string_view line) {
  const auto fault = [](std::string what) { return Error{ErrorKind::kInput, std::move(what)}; };
  if (has_decimal_commas(line)) return fault("decimal commas; numbers need a decimal point");
  const auto words = words_of(line, ",;");
  if (words.size() < 8) {
    return fault(std::to_string(words.size()) + " columns, needs 8 (stamp tx ty tz qx qy qz qw)");
  }
  const auto stamp = parse_stamp(words[0]);
  if (!stamp) return fault("'" + printable(words[0]) + "' is no stamp");
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    const auto value = parse_number(words[i + 1]);
    if (!value || std::abs(*value) > 1e9) {
      return fault("'" + printable(words[i + 1]) + "' is no finite number of sensible size");
    }
    v[i] = *value;
  }
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
  if (q.norm() < kLeastQuaternionLength) return fault("quaternion without length");
  return StampedPose{stamp->stamp, SE3(q, {v[0], v[1], v[2]})};
}

// Fixed notation with nine decimals; a value that rounds to zero gets no minus sign.
void append_number(std::string& line, double value) {
  std::array<char, 64> buffer;  // |value| <= 1e15 fits easily
  if (std::abs(value) < 0.5e-9) value = 0.0;
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                    std::chars_format::fixed, 9);
  CHECK(result.ec == std::errc{}, "pose too far from the origin to be written");
  line.push_back(' ');
  line.append(buffer.data(), result.ptr);
}

bool writable(const SE3& pose) { return pose.is_finite() && pose.t().cwiseAbs().maxCoeff() < 1e15; }

}  // namespace

Result<std::vector<StampedPose>> parse_tum_trajectory(std::string_view text,
                                                      const std::string& name) {
  const Status line_ends = check_line_ends(text, name);
  if (!line_ends.ok()) return line_ends.error();
  std::vector<StampedPose> poses;
  for (const TextLine& line : data_lines(text)) {
    const auto pose = parse_pose(line.text);
    if (!pose.ok()) {
      return Error{ErrorKind::kInput,
                   name + ":" + std::to_string(line.number) + ": " + pose.error().message};
    }
    poses.push_back(*pose);
  }
  if (poses.empty()) return Error{ErrorKind::kInput, name + ": no pose in the file"};
  std::stable_sort(poses.begin(), poses.end(),
                   [](const auto& a, const auto& b) { return a.stamp < b.stamp; });
  const auto last = std::unique(poses.begin(), poses.end(),
                                [](const auto& a, const auto& b) { return a.stamp == b.stamp; });
  if (last != poses.end()) {
    log::warn("{}: {} poses repeat a stamp and are ignored", name, poses.end() - last);
    poses.erase(last, poses.end());
  }
  return poses;
}

Result<std::vector<StampedPose>> read_tum_trajectory(const std::filesystem::path& path) {
  const auto text = read_file(path, std::size_t{1} << 30);
  if (!text.ok()) return text.error();
  return parse_tum_trajectory(*text, path.string());
}

std::string format_tum(const StampedPose& pose, int stamp_decimals) {
  CHECK(writable(pose.T_world_camera), "a pose that is not finite must not be written");
  Eigen::Quaterniond q = pose.T_world_camera.quaternion().normalized();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  std::string line = format_stamp(pose.stamp, stamp_decimals);
  const Vec3& t = pose.T_world_camera.t();
  for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    append_number(line, value);
  }
  line.push_back('\n');
  return line;
}

std::string format_tum(std::span<const StampedPose> poses, int stamp_decimals) {
  std::string text;
  std::size_t left_out = 0;
  for (const StampedPose& pose : poses) {
    if (writable(pose.T_world_camera)) {
      text += format_tum(pose, stamp_decimals);
    } else {
      ++left_out;
    }
  }
  if (left_out > 0) log::error("{} poses were not finite and are not written", left_out);
  return text;
}

}  // namespace ygslam
