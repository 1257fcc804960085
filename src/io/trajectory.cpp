#include "io/trajectory.hpp"

#include <array>
#include <charconv>
#include <cmath>

#include "core/log.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

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
