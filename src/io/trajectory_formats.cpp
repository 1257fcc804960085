#include "io/trajectory_formats.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "core/log.hpp"
#include "io/text.hpp"
#include "io/trajectory_checks.hpp"

namespace ygslam {
namespace {

constexpr std::array<std::pair<std::string_view, TrajectoryFormat>, 3> kNames = {{
    {"tum", TrajectoryFormat::kTum},
    {"kitti", TrajectoryFormat::kKitti},
    {"euroc", TrajectoryFormat::kEuroc},
}};
constexpr std::size_t kTumColumns = 8, kEurocColumns = 8;
constexpr std::size_t kLargestFile_bytes = std::size_t{1} << 30;
constexpr double kLargest_m = 1e9;
// Seconds of our century have ten digits before the point; nanoseconds have nineteen. Clocks that
// start near zero are told apart by the missing point only, so a whole number must be this large.
constexpr std::size_t kLeastNanosecondDigits = 12;

constexpr double kLeastStep_s = 1e-6, kGreatestStep_s = 86400;

Error input_fault(std::string what) { return {ErrorKind::kInput, std::move(what)}; }

bool is_whole_number(std::string_view word) {
  return !word.empty() &&
         std::all_of(word.begin(), word.end(), [](char c) { return c >= '0' && c <= '9'; });
}

// Numbers of the words from `first` on, or which of them is none.
template <std::size_t N>
Result<std::array<double, N>> numbers(const std::vector<std::string_view>& words,
                                      std::size_t first) {
  std::array<double, N> values{};
  for (std::size_t i = 0; i < N; ++i) {
    const auto value = parse_number(words[first + i]);
    if (!value || std::abs(*value) > kLargest_m) {
      return input_fault("'" + printable(words[first + i]) +
                         "' is no finite number of sensible size");
    }
    values[i] = *value;
  }
  return values;
}

Result<StampedPose> pose_of(Timestamp stamp, const Eigen::Quaterniond& q, const Vec3& p) {
  if (q.norm() < kLeastQuaternionLength) return input_fault("quaternion without length");
  return StampedPose{stamp, SE3(q, p)};
}

Result<StampedPose> parse_tum(std::string_view line, std::size_t /*position*/) {
  const auto words = words_of(line, ",;");
  if (words.size() < kTumColumns) {
    return input_fault(std::to_string(words.size()) +
                       " columns, needs 8 (stamp tx ty tz qx qy qz qw)");
  }
  const auto stamp = parse_stamp(words[0]);
  if (!stamp) return input_fault("'" + printable(words[0]) + "' is no stamp");
  const auto v = numbers<kTumColumns - 1>(words, 1);
  if (!v.ok()) return v.error();
  return pose_of(stamp->stamp, {(*v)[6], (*v)[3], (*v)[4], (*v)[5]}, {(*v)[0], (*v)[1], (*v)[2]});
}

Result<StampedPose> parse_kitti(std::string_view line, std::size_t position) {
  const auto words = words_of(line, ",;");
  if (words.size() != kKittiColumns) {
    return input_fault(std::to_string(words.size()) + " columns, KITTI poses have 12 (3x4 matrix)");
  }
  const auto v = numbers<kKittiColumns>(words, 0);
  if (!v.ok()) return v.error();
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> matrix(v->data());
  const Mat3 R = matrix.leftCols<3>();
  if ((R * R.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() > kRotationTolerance ||
      R.determinant() < 0) {
    return input_fault("the matrix is no rotation");
  }
  return StampedPose{{static_cast<std::int64_t>(position)}, SE3(R, matrix.col(3)).normalized()};
}

Result<StampedPose> parse_euroc(std::string_view line, std::size_t /*position*/) {
  const auto words = words_of(line, ",;");
  if (words.size() < kEurocColumns) {
    return input_fault(std::to_string(words.size()) +
                       " columns, EuRoC needs 8 (stamp px py pz qw qx qy qz)");
  }
  std::int64_t ns = 0;
  const auto [end, code] = std::from_chars(words[0].data(), words[0].data() + words[0].size(), ns);
  if (code != std::errc{} || end != words[0].data() + words[0].size()) {
    return input_fault("'" + printable(words[0]) + "' is no stamp in nanoseconds");
  }
  const auto v = numbers<kEurocColumns - 1>(words, 1);
  if (!v.ok()) return v.error();
  return pose_of({ns}, {(*v)[3], (*v)[4], (*v)[5], (*v)[6]}, {(*v)[0], (*v)[1], (*v)[2]});
}

void put_in_order(const std::string& name, std::vector<StampedPose>& poses) {
  std::stable_sort(poses.begin(), poses.end(),
                   [](const auto& a, const auto& b) { return a.stamp < b.stamp; });
  const auto last = std::unique(poses.begin(), poses.end(),
                                [](const auto& a, const auto& b) { return a.stamp == b.stamp; });
  if (last == poses.end()) return;
  log::warn("{}: {} poses repeat a stamp and are ignored", name, poses.end() - last);
  poses.erase(last, poses.end());
}

template <typename ParseLine>
Result<std::vector<StampedPose>> parse_lines(std::string_view text, const std::string& name,
                                             ParseLine parse_line) {
  const Status line_ends = check_line_ends(text, name);
  if (!line_ends.ok()) return line_ends.error();
  std::vector<StampedPose> poses;
  for (const TextLine& line : data_lines(text)) {
    const Result<StampedPose> pose =
        has_decimal_commas(line.text) ? input_fault("decimal commas; numbers need a decimal point")
                                      : parse_line(line.text, poses.size());
    if (!pose.ok()) {
      return input_fault(name + ":" + std::to_string(line.number) + ": " + pose.error().message);
    }
    poses.push_back(*pose);
  }
  if (poses.empty()) return input_fault(name + ": no pose in the file");
  put_in_order(name, poses);
  return poses;
}

// KITTI poses would pass as TUM lines with further columns.
Status check_is_tum(std::string_view text, const std::string& name) {
  const auto lines = data_lines(text);
  if (lines.empty() || !looks_like_kitti(lines.front().text)) return Ok{};
  const bool is_whole = words_of(lines.front().text, ",;").size() == kKittiColumns;
  return input_fault(name + ":" + std::to_string(lines.front().number) +
                     (is_whole
                          ? ": a KITTI pose (12 numbers with a rotation matrix), not a TUM line"
                          : ": 11 columns, a KITTI pose of 12 with one missing"));
}

// Stamps in another unit than the format's show in their distance from each other.
Status check_step(const std::vector<StampedPose>& poses, TrajectoryFormat format,
                  const std::string& name) {
  if (poses.size() < 2) return Ok{};
  const double step_s = seconds_between(poses.back().stamp, poses.front().stamp) /
                        static_cast<double>(poses.size() - 1);
  if (format == TrajectoryFormat::kEuroc && step_s < kLeastStep_s) {
    return input_fault(name + ": poses less than a microsecond apart; are the stamps nanoseconds?");
  }
  if (format == TrajectoryFormat::kTum && step_s > kGreatestStep_s) {
    return input_fault(name +
                       ": poses more than a day apart; are the stamps seconds? (nanoseconds: "
                       "--format euroc)");
  }
  return Ok{};
}

}  // namespace

std::optional<TrajectoryFormat> parse_trajectory_format(std::string_view name) {
  for (const auto& [known, format] : kNames) {
    if (known == name) return format;
  }
  return std::nullopt;
}

std::string_view name_of(TrajectoryFormat format) {
  for (const auto& [name, known] : kNames) {
    if (known == format) return name;
  }
  return "?";
}

TrajectoryFormat recognise_trajectory(std::string_view text) {
  const auto lines = data_lines(text);
  if (lines.empty()) return TrajectoryFormat::kTum;
  const auto words = words_of(lines.front().text, ",;");
  if (words.size() == kKittiColumns) return TrajectoryFormat::kKitti;
  const bool has_commas = lines.front().text.find(',') != std::string_view::npos;
  if (has_commas && words.size() >= kEurocColumns && is_whole_number(words[0]) &&
      words[0].size() >= kLeastNanosecondDigits) {
    return TrajectoryFormat::kEuroc;
  }
  return TrajectoryFormat::kTum;
}

Result<TrajectoryFile> parse_trajectory(std::string_view text, const std::string& name,
                                        std::optional<TrajectoryFormat> format) {
  TrajectoryFile file;
  file.format = format.value_or(recognise_trajectory(text));
  file.has_stamps = file.format != TrajectoryFormat::kKitti;
  if (file.format == TrajectoryFormat::kTum) {
    const Status is_tum = check_is_tum(text, name);
    if (!is_tum.ok()) return is_tum.error();
  }
  auto poses = file.format == TrajectoryFormat::kTum     ? parse_lines(text, name, parse_tum)
               : file.format == TrajectoryFormat::kKitti ? parse_lines(text, name, parse_kitti)
                                                         : parse_lines(text, name, parse_euroc);
  if (!poses.ok()) return poses.error();
  const Status step = check_step(*poses, file.format, name);
  if (!step.ok()) return step.error();
  file.poses = std::move(*poses);
  return file;
}

Result<TrajectoryFile> read_trajectory(const std::filesystem::path& path,
                                       std::optional<TrajectoryFormat> format) {
  const auto text = read_file(path, kLargestFile_bytes);
  if (!text.ok()) return text.error();
  return parse_trajectory(*text, path.string(), format);
}

Result<std::vector<StampedPose>> parse_tum_trajectory(std::string_view text,
                                                      const std::string& name) {
  return parse_lines(text, name, parse_tum);
}

Result<std::vector<StampedPose>> read_tum_trajectory(const std::filesystem::path& path) {
  const auto text = read_file(path, kLargestFile_bytes);
  if (!text.ok()) return text.error();
  return parse_tum_trajectory(*text, path.string());
}

Status add_stamps(const std::filesystem::path& times, const std::string& name,
                  TrajectoryFile& trajectory) {
  const auto text = read_file(times);
  if (!text.ok()) return text.error();
  const Status line_ends = check_line_ends(*text, times.string());
  if (!line_ends.ok()) return line_ends.error();
  std::vector<Timestamp> stamps;
  for (const TextLine& line : data_lines(*text)) {
    const std::string place = times.string() + ":" + std::to_string(line.number) + ": ";
    if (is_decimal_comma(line.text))
      return input_fault(place + "a decimal comma; needs a decimal point");
    const auto words = words_of(line.text, ",;");
    const auto stamp = words.empty() ? std::nullopt : parse_stamp(words.front());
    if (!stamp) return input_fault(place + "'" + printable(line.text) + "' is no stamp");
    if (!stamps.empty() && stamp->stamp <= stamps.back())
      return input_fault(place + "not increasing");
    stamps.push_back(stamp->stamp);
  }
  if (stamps.size() != trajectory.poses.size()) {
    return input_fault(times.string() + ": " + std::to_string(stamps.size()) + " stamps for the " +
                       std::to_string(trajectory.poses.size()) + " poses of " + name);
  }
  for (std::size_t i = 0; i < stamps.size(); ++i) trajectory.poses[i].stamp = stamps[i];
  trajectory.has_stamps = true;
  return Ok{};
}

}  // namespace ygslam
