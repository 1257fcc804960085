#include "io/wheel_file.hpp"

#include <algorithm>

#include "core/log.hpp"
#include "io/text.hpp"
#include "io/trajectory_checks.hpp"
#include "io/trajectory_formats.hpp"

namespace ygslam {
namespace {

constexpr double kMostSpeed_mps = 15;  // of the median step with motion
constexpr double kMostWheelStep_s = 0.25, kLeastWheelStep_s = 5e-4;

constexpr std::size_t kLeastColumns = 8;  // of poses with stamps, in any format

/// Of the longest line of a text of numbers. @return 0 where it is none.
std::size_t most_columns(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text.ok() || !check_is_text(*text, "").ok()) return 0;
  std::size_t most = 0;
  for (const TextLine& line : data_lines(*text)) {
    const auto words = words_of(line.text, ",;");
    if (words.empty() || !parse_number(words.front())) return 0;
    most = std::max(most, words.size());
  }
  return most;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

Result<std::vector<OdometrySample>> wheels_of_poses(std::span<const StampedPose> poses) {
  std::vector<OdometrySample> samples;
  std::vector<double> steps_s, speeds_mps;
  for (const StampedPose& pose : poses) {
    if (!samples.empty()) {
      const double step_s = seconds_between(pose.stamp, samples.back().stamp);
      const double way_m = (pose.T_world_camera.t() - samples.back().T_odom_base.t()).norm();
      steps_s.push_back(step_s);
      if (way_m > 0 && step_s > 0) speeds_mps.push_back(way_m / step_s);
    }
    samples.push_back({pose.stamp, pose.T_world_camera});
  }
  if (steps_s.empty()) return Error{ErrorKind::kInput, "a single pose; wheels tell many a second"};
  const double step_s = median(steps_s);
  if (step_s < kLeastWheelStep_s || step_s > kMostWheelStep_s)
    return Error{ErrorKind::kInput,
                 fmt::format("poses are {:.3g} s apart, which no wheels' are", step_s)};
  if (!speeds_mps.empty() && median(speeds_mps) > kMostSpeed_mps)
    return Error{ErrorKind::kInput,
                 fmt::format("{:.3g} m/s at the median, which no robot drives: metres and seconds "
                             "are expected",
                             median(speeds_mps))};
  return samples;
}

Result<std::vector<OdometrySample>> read_wheels(const std::filesystem::path& path) {
  std::error_code code;
  if (std::filesystem::is_directory(path, code))
    return Error{ErrorKind::kInput, path.string() + ": a folder; poses of the wheels are expected"};
  const auto poses = read_stamped_trajectory(path);
  if (!poses.ok()) {
    const std::size_t columns = most_columns(path);
    if (columns == 0 || columns >= kLeastColumns) return poses.error();
    return Error{ErrorKind::kInput,
                 fmt::format("{}: {} columns; stamps and poses are expected (t x y z qx qy qz qw)",
                             path.string(), columns)};
  }
  auto samples = wheels_of_poses(*poses);
  if (!samples.ok())
    return Error{samples.error().kind, path.string() + ": " + samples.error().message};
  return samples;
}

}  // namespace ygslam
