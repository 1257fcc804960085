#include "io/trajectory_formats.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/log.hpp"
#include "io/associated_poses.hpp"
#include "io/folder_truth.hpp"
#include "io/text.hpp"
#include "io/trajectory_checks.hpp"
#include "io/trajectory_evidence.hpp"
#include "io/trajectory_recognition.hpp"
#include "io/trajectory_warnings.hpp"

namespace ygslam {
namespace {

constexpr std::array<std::pair<std::string_view, TrajectoryFormat>, 3> kNames = {{
    {"tum", TrajectoryFormat::kTum},
    {"kitti", TrajectoryFormat::kKitti},
    {"euroc", TrajectoryFormat::kEuroc},
}};
constexpr std::array<std::string_view, 4> kStampUnits = {"s", "ms", "us", "ns"};
constexpr std::size_t kTumColumns = 8;
constexpr std::size_t kLargestFile_bytes = std::size_t{1} << 30;
constexpr double kLargest_m = 1e9;
constexpr double kLeastStep_s = 1e-6, kGreatestStep_s = 86400;

Error input_fault(std::string what) { return {ErrorKind::kInput, std::move(what)}; }

// The fields at the given columns as numbers, or which of them is none.
template <std::size_t N>
Result<std::array<double, N>> numbers_at(const PoseRecord& record,
                                         const std::array<std::size_t, N>& columns) {
  std::array<double, N> values{};
  for (std::size_t i = 0; i < N; ++i) {
    const std::string_view field = record.fields[columns[i]];
    const auto value = parse_number(field);
    if (!value || std::abs(*value) > kLargest_m)
      return input_fault("'" + printable(field) + "' is no finite number of sensible size");
    values[i] = *value;
  }
  return values;
}

Result<SE3> quaternion_pose(const PoseRecord& record, const PoseColumns& columns) {
  const auto p = numbers_at(record, columns.position_at);
  if (!p.ok()) return p.error();
  const auto q = numbers_at(record, columns.quaternion_at);
  if (!q.ok()) return q.error();
  const Eigen::Quaterniond quaternion((*q)[3], (*q)[0], (*q)[1], (*q)[2]);
  const double length = quaternion.norm();
  if (!(std::abs(length - 1) < kQuaternionTolerance)) {
    return input_fault(length < kQuaternionTolerance
                           ? "quaternion without length"
                           : fmt::format("quaternion of length {:.3g}, not 1", length));
  }
  return SE3(quaternion, {(*p)[0], (*p)[1], (*p)[2]});
}

Result<SE3> matrix_pose(const PoseRecord& record, const PoseColumns& columns) {
  const bool is_3x4 = columns.pose == PoseColumns::Pose::kMatrix3x4;
  const std::size_t size = is_3x4 ? 12 : 16;
  if (record.fields.size() != columns.matrix_at + size) {
    return input_fault(
        fmt::format("{} columns, not {}", record.fields.size(), columns.matrix_at + size));
  }
  std::array<std::size_t, 16> at{};
  for (std::size_t i = 0; i < at.size(); ++i) at[i] = columns.matrix_at + (i < size ? i : size - 1);
  const auto v = numbers_at(record, at);
  if (!v.ok()) return v.error();
  Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(v->data());
  if (columns.pose == PoseColumns::Pose::kMatrix4x4ByColumns) matrix.transposeInPlace();
  if (!is_3x4 && (matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() > 1e-6)
    return input_fault("the matrix's last row is not 0 0 0 1");
  const Mat3 R = matrix.topLeftCorner<3, 3>();
  if ((R * R.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() > kRotationTolerance)
    return input_fault("the matrix is no rotation");
  if (R.determinant() < 0) return input_fault("the matrix is no rotation but a reflection");
  return SE3(R, matrix.topRightCorner<3, 1>()).normalized();
}

Result<Timestamp> split_stamp(const PoseRecord& record, const PoseColumns& columns) {
  const std::string_view seconds = record.fields[columns.stamp_at];
  const std::string_view nanoseconds = record.fields[columns.nanoseconds_at];
  const auto s = parse_stamp(seconds, StampUnit::kSeconds);
  const auto ns = parse_stamp(nanoseconds, StampUnit::kNanoseconds);
  constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
  if (!s || s->ns % kNanosecondsPerSecond != 0 || !ns || ns->ns < 0 ||
      ns->ns >= kNanosecondsPerSecond) {
    return input_fault("'" + printable(seconds) + "' and '" + printable(nanoseconds) +
                       "' are no seconds and nanoseconds");
  }
  return Timestamp{s->ns + ns->ns};
}

// A stamp as a file name: seconds with a point, or a whole number in any unit.
std::optional<Timestamp> stamp_of_image(std::string_view name) {
  name = name.substr(name.find_last_of("/\\") + 1);
  name = name.substr(0, name.find_last_of('.'));
  constexpr std::size_t kLeastDigits = 13;  // milliseconds since 1970; fewer count images
  if (name.find('.') == std::string_view::npos && name.size() < kLeastDigits) return std::nullopt;
  const std::vector<PoseRecord> one = {{0, {name}}};
  return parse_stamp(name, unit_of_stamps(one, 0));
}

Result<Timestamp> stamp_of(const PoseRecord& record, const PoseColumns& columns, StampUnit unit,
                           std::size_t position) {
  switch (columns.stamp) {
    case PoseColumns::Stamp::kNone:
      return Timestamp{static_cast<std::int64_t>(position)};
    case PoseColumns::Stamp::kSecondsAndNanoseconds:
      return split_stamp(record, columns);
    case PoseColumns::Stamp::kImageName: {
      const std::string_view name = record.fields[columns.stamp_at];
      const auto stamp = stamp_of_image(name);
      if (stamp) return *stamp;
      return input_fault("the image's name '" + printable(name) + "' is no stamp");
    }
    case PoseColumns::Stamp::kNumber:
      break;
  }
  const std::string_view word = record.fields[columns.stamp_at];
  const auto stamp = parse_stamp(word, unit);
  if (!stamp)
    return input_fault("'" + printable(word) + "' is no stamp in " + std::string(name_of(unit)));
  return *stamp;
}

std::size_t columns_needed(const PoseColumns& columns) {
  std::size_t most = columns.stamp_at;
  if (columns.stamp == PoseColumns::Stamp::kSecondsAndNanoseconds)
    most = std::max(most, columns.nanoseconds_at);
  if (columns.pose == PoseColumns::Pose::kQuaternion) {
    for (const std::size_t at : columns.position_at) most = std::max(most, at);
    for (const std::size_t at : columns.quaternion_at) most = std::max(most, at);
  }
  return most + 1;
}

Result<StampedPose> pose_of(const PoseRecord& record, const PoseColumns& columns, StampUnit unit,
                            std::size_t position) {
  const std::size_t needed = columns_needed(columns);
  const bool exact = columns.stamp == PoseColumns::Stamp::kNone &&
                     columns.pose == PoseColumns::Pose::kQuaternion && needed == kTumColumns - 1;
  if (record.fields.size() < needed || (exact && record.fields.size() > needed)) {
    return input_fault(fmt::format("{} columns, needs {}{}", record.fields.size(), needed,
                                   needed == kTumColumns ? " (stamp tx ty tz qx qy qz qw)" : ""));
  }
  const auto stamp = stamp_of(record, columns, unit, position);
  if (!stamp.ok()) return stamp.error();
  auto pose = columns.pose == PoseColumns::Pose::kQuaternion ? quaternion_pose(record, columns)
                                                             : matrix_pose(record, columns);
  if (!pose.ok()) return pose.error();
  return StampedPose{*stamp, columns.is_camera_from_world ? pose->inverse() : *pose};
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

Result<std::vector<StampedPose>> poses_of(const PoseText& text, StampUnit unit,
                                          const std::string& name) {
  std::vector<StampedPose> poses;
  poses.reserve(text.records.size());
  for (const PoseRecord& record : text.records) {
    const auto pose = pose_of(record, text.columns, unit, poses.size());
    if (!pose.ok())
      return input_fault(name + ":" + std::to_string(record.line) + ": " + pose.error().message);
    poses.push_back(*pose);
  }
  if (poses.empty()) return input_fault(name + ": no pose in the file");
  if (text.columns.pose == PoseColumns::Pose::kQuaternion && !text.columns.is_camera_from_world)
    warn_of_mixed_orders(text, poses, name);
  warn_of_order(text, poses, name);
  put_in_order(name, poses);
  warn_of_blanks(poses, name);
  return poses;
}

Status check_lines(std::string_view text, const std::string& name) {
  if (Status readable = check_is_text(text, name); !readable.ok()) return readable;
  if (Status line_ends = check_line_ends(text, name); !line_ends.ok()) return line_ends;
  if (const int line = line_with_brackets(text); line > 0)
    return input_fault(name + ":" + std::to_string(line) + ": JSON, or numbers in brackets; " +
                       accepted_trajectories());
  for (const TextLine& line : data_lines(text)) {
    if (has_decimal_commas(line.text))
      return input_fault(name + ":" + std::to_string(line.number) +
                         ": decimal commas; numbers need a decimal point");
  }
  return Ok{};
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

// Stamps in another unit show in their distance from each other.
Status check_step(const std::vector<StampedPose>& poses, const std::string& name) {
  if (poses.size() < 2) return Ok{};
  const double step_s = seconds_between(poses.back().stamp, poses.front().stamp) /
                        static_cast<double>(poses.size() - 1);
  if (step_s < kLeastStep_s) {
    return input_fault(name + ": poses less than a microsecond apart; are the stamps nanoseconds?");
  }
  if (step_s > kGreatestStep_s) {
    return input_fault(name +
                       ": poses more than a day apart; are the stamps seconds? (--stamps ns for "
                       "nanoseconds, ms or us)");
  }
  return Ok{};
}

// The file as what it is declared to be.
PoseText declared(std::string_view text, TrajectoryFormat format) {
  PoseText poses;
  for (const TextLine& line : data_lines(text))
    poses.records.push_back({line.number, words_of(line.text, ",;")});
  poses.columns.position_at = {1, 2, 3};
  poses.columns.quaternion_at = {4, 5, 6, 7};
  if (format == TrajectoryFormat::kEuroc) {
    poses.columns.quaternion_at = {5, 6, 7, 4};
    poses.columns.unit = StampUnit::kNanoseconds;
  }
  if (format == TrajectoryFormat::kKitti) {
    poses.columns.stamp = PoseColumns::Stamp::kNone;
    poses.columns.pose = PoseColumns::Pose::kMatrix3x4;
  }
  return poses;
}

Result<PoseText> pose_text(std::string_view text, const std::string& name,
                           std::optional<TrajectoryFormat> format) {
  if (format && *format != TrajectoryFormat::kTum) return declared(text, *format);
  const auto lines = data_lines(text);
  const bool may_be_kitti =
      !format && !lines.empty() && words_of(lines.front().text, ",;").size() == kKittiColumns;
  if (Status is_tum = check_is_tum(text, name); !is_tum.ok() && !may_be_kitti)
    return is_tum.error();
  return format ? Result<PoseText>(declared(text, *format)) : recognise_poses(text, name);
}

// The images of COLMAP have stamps for names, or are in the order of their names.
void number_images(PoseText& text) {
  const std::size_t at = text.columns.stamp_at;
  if (std::all_of(text.records.begin(), text.records.end(), [at](const PoseRecord& record) {
        return stamp_of_image(record.fields[at]).has_value();
      }))
    return;
  std::stable_sort(text.records.begin(), text.records.end(), [at](const auto& a, const auto& b) {
    return std::pair(a.fields[at].size(), a.fields[at]) <
           std::pair(b.fields[at].size(), b.fields[at]);
  });
  text.columns.stamp = PoseColumns::Stamp::kNone;
  text.columns.stamp_at = 0;
  text.taken_for += ", no stamps, in the order of the images' names";
}

StampUnit choose_unit(PoseText& text, const TrajectoryReading& reading) {
  if (text.columns.stamp != PoseColumns::Stamp::kNumber) return StampUnit::kSeconds;
  if (reading.unit) return *reading.unit;
  const StampUnit unit =
      text.columns.unit ? *text.columns.unit : unit_of_stamps(text.records, text.columns.stamp_at);
  if (unit != StampUnit::kSeconds)
    text.taken_for +=
        fmt::format("{}, stamps in {}", text.taken_for.empty() ? "TUM" : "", name_of(unit));
  return unit;
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

std::optional<StampUnit> parse_stamp_unit(std::string_view name) {
  const auto unit = std::find(kStampUnits.begin(), kStampUnits.end(), name);
  return unit == kStampUnits.end()
             ? std::nullopt
             : std::optional(static_cast<StampUnit>(unit - kStampUnits.begin()));
}

Result<TrajectoryFile> parse_trajectory(std::string_view text, const std::string& name,
                                        const TrajectoryReading& reading) {
  if (const auto poses = reading.format ? std::nullopt : poses_of_associations(text)) {
    auto file = parse_trajectory(*poses, name, reading);
    if (file.ok()) file->taken_for = "poses in a list of associated images";
    return file;
  }
  if (Status lines = check_lines(text, name); !lines.ok()) return lines.error();
  auto poses = pose_text(text, name, reading.format);
  if (!poses.ok()) return poses.error();
  if (poses->columns.stamp == PoseColumns::Stamp::kImageName) number_images(*poses);
  const StampUnit unit = choose_unit(*poses, reading);
  auto read = poses_of(*poses, unit, name);
  if (!read.ok()) return read.error();
  TrajectoryFile file;
  file.has_stamps = poses->columns.stamp != PoseColumns::Stamp::kNone;
  if (Status step = file.has_stamps ? check_step(*read, name) : Status(Ok{}); !step.ok())
    return step.error();
  file.poses = std::move(*read);
  file.reads_w_first = poses->columns.pose == PoseColumns::Pose::kQuaternion &&
                       poses->columns.quaternion_at[3] < poses->columns.quaternion_at[0];
  if (!reading.format) file.taken_for = std::move(poses->taken_for);
  return file;
}

Result<TrajectoryFile> read_trajectory(const std::filesystem::path& path,
                                       const TrajectoryReading& reading) {
  std::error_code code;
  if (std::filesystem::is_directory(path, code)) return read_truth_folder(path);
  const auto text = read_file(path, kLargestFile_bytes);
  if (!text.ok()) return text.error();
  auto file = parse_trajectory(*text, path.string(), reading);
  if (file.ok() && !file->taken_for.empty())
    log::info("{}: read as {}", path.string(), file->taken_for);
  return file;
}

Result<std::vector<StampedPose>> read_stamped_trajectory(const std::filesystem::path& path) {
  auto file = read_trajectory(path);
  if (!file.ok()) return file.error();
  if (file->has_stamps) return std::move(file->poses);
  return input_fault(path.string() + ": has no stamps (read as " + file->taken_for + ")");
}

Result<std::vector<StampedPose>> parse_tum_trajectory(std::string_view text,
                                                      const std::string& name) {
  if (Status lines = check_lines(text, name); !lines.ok()) return lines.error();
  return poses_of(declared(text, TrajectoryFormat::kTum), StampUnit::kSeconds, name);
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
