#include "io/imu_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "core/log.hpp"
#include "io/imu_checks.hpp"
#include "io/text.hpp"
#include "io/trajectory_checks.hpp"
#include "io/trajectory_columns.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kNoColumn = static_cast<std::size_t>(-1);
constexpr std::size_t kImuColumns = 7, kAccelerometerColumns = 4;
constexpr std::size_t kLargestImuFile_bytes = std::size_t{1} << 30;
constexpr double kMostRadps = 1e4, kMostMps2 = 1e5;
constexpr std::string_view kEurocHeader =
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";

enum class Sensor { kImu, kAccelerometer };

/// What stands in which column, counted from 0.
struct ImuColumns {
  std::size_t count = 0;
  std::size_t stamp = 0;
  std::array<std::size_t, 3> gyro = {kNoColumn, kNoColumn, kNoColumn};
  std::array<std::size_t, 3> accel = {kNoColumn, kNoColumn, kNoColumn};
  std::optional<StampUnit> unit;
  bool are_named = false;

  [[nodiscard]] bool has_gyro() const { return gyro[0] != kNoColumn; }
};

struct ImuRow {
  int line = 0;
  ImuSample sample;
};

Error fault_in(const std::string& name, int line, const std::string& what) {
  const std::string where = line > 0 ? name + ":" + std::to_string(line) : name;
  return {ErrorKind::kInput, where + ": " + what};
}

std::vector<std::string_view> fields_of(std::string_view line) {
  return line.find_first_of(",;") == std::string_view::npos ? words_of(line) : csv_fields(line);
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

/// Whether a name is of the sensor that one of `marks` stands for: `wx`, `w_RS_S_x [rad s^-1]`.
bool is_of(const std::string& name, std::initializer_list<std::string_view> marks) {
  return std::any_of(marks.begin(), marks.end(), [&](std::string_view mark) {
    return mark.size() == 1 ? name.starts_with(mark) && (name.size() == 2 || name[1] == '_')
                            : name.find(mark) != std::string::npos;
  });
}

/// The columns that a line of names stands for; nothing where they are not all there, or twice.
std::optional<ImuColumns> columns_named(std::string_view line) {
  ImuColumns columns;
  columns.are_named = true;
  columns.stamp = kNoColumn;
  const auto take = [](std::size_t& place, std::size_t column) {
    return std::exchange(place, column) == kNoColumn;
  };
  const auto fields = fields_of(line);
  columns.count = fields.size();
  for (std::size_t i = 0; i < fields.size(); ++i) {
    std::string whole = lower(fields[i]);
    const std::string name = std::string(trimmed(whole.substr(0, whole.find('['))));
    if (name.empty()) continue;
    const bool is_t = name == "t";  // or a temperature behind the time
    if (is_t || name.find("time") == 0 || name.find("stamp") != std::string::npos) {
      if (is_t && columns.stamp != kNoColumn) continue;
      if (!take(columns.stamp, i)) return std::nullopt;
      if (whole.find("[ns]") != std::string::npos) columns.unit = StampUnit::kNanoseconds;
      continue;
    }
    const int axis = name.back() - 'x';
    if (axis < 0 || axis > 2) continue;
    const auto a = static_cast<std::size_t>(axis);
    const bool is_gyro = is_of(name, {"w", "g", "gyr", "ang", "omega"});
    const bool is_accel = is_of(name, {"a", "acc", "lin"}) && !is_of(name, {"ang"});
    if (is_gyro == is_accel) continue;
    if (!take(is_gyro ? columns.gyro[a] : columns.accel[a], i)) return std::nullopt;
  }
  const auto missing = [](const auto& three) {
    return std::count(three.begin(), three.end(), kNoColumn);
  };
  if (columns.stamp == kNoColumn || missing(columns.accel) > 0) return std::nullopt;
  if (missing(columns.gyro) % 3 != 0) return std::nullopt;
  return columns;
}

/// The names in a comment before the data, or in the first line.
std::optional<ImuColumns> columns_of_header(std::string_view text, int first_line) {
  std::optional<ImuColumns> columns;
  for (int number = 1; number < first_line && !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = trimmed(text.substr(0, end));
    if (line.starts_with('#'))
      if (auto named = columns_named(trimmed(line.substr(1)))) columns = named;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return columns;
}

/// By their number alone, as EuRoC and TUM have them.
Result<ImuColumns> columns_by_place(const TextLine& line, const std::string& name) {
  const std::size_t count = fields_of(line.text).size();
  if (count == kImuColumns) return ImuColumns{count, 0, {1, 2, 3}, {4, 5, 6}, {}, false};
  if (count == kAccelerometerColumns)
    return ImuColumns{count, 0, {kNoColumn, kNoColumn, kNoColumn}, {1, 2, 3}, {}, false};
  return fault_in(name, line.number,
                  fmt::format("{} columns, not 7 (stamp, angular velocity, acceleration) or 4 "
                              "(stamp, acceleration)",
                              count));
}

Result<Vec3> vector_at(const std::vector<std::string_view>& fields,
                       const std::array<std::size_t, 3>& columns, double most) {
  Vec3 value;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto number = parse_number(fields[columns[i]]);
    if (!number || std::abs(*number) > most)
      return Error{ErrorKind::kInput,
                   "'" + printable(fields[columns[i]]) + "' is no finite number of sensible size"};
    value[static_cast<Eigen::Index>(i)] = *number;
  }
  return value;
}

Result<ImuRow> row_of(const TextLine& line, const ImuColumns& columns, StampUnit unit,
                      const std::string& name) {
  const auto fields = fields_of(line.text);
  if (fields.size() != columns.count)
    return fault_in(name, line.number,
                    fmt::format("{} columns, not {}", fields.size(), columns.count));
  ImuRow row;
  row.line = line.number;
  const std::string_view word = fields[columns.stamp];
  const auto stamp = parse_stamp(word, unit);
  if (!stamp)
    return fault_in(name, line.number,
                    fmt::format("'{}' is no stamp in {}{}", printable(word), name_of(unit),
                                columns.unit ? ", which the header names" : ""));
  row.sample.stamp = *stamp;
  const auto accel = vector_at(fields, columns.accel, kMostMps2);
  if (!accel.ok()) return fault_in(name, line.number, accel.error().message);
  row.sample.specific_force_mps2 = *accel;
  row.sample.angular_velocity_radps = Vec3::Zero();
  if (!columns.has_gyro()) return row;
  const auto gyro = vector_at(fields, columns.gyro, kMostRadps);
  if (!gyro.ok()) return fault_in(name, line.number, gyro.error().message);
  row.sample.angular_velocity_radps = *gyro;
  return row;
}

/// Between the first two lines. @return 0 where there are none.
double first_step_s(const std::vector<TextLine>& lines, std::size_t column, StampUnit unit) {
  std::array<std::optional<Timestamp>, 2> stamps;
  for (std::size_t i = 0; i < std::min(lines.size(), stamps.size()); ++i)
    if (const auto fields = fields_of(lines[i].text); column < fields.size())
      stamps[i] = parse_stamp(fields[column], unit);
  return stamps[0] && stamps[1] ? seconds_between(*stamps[1], *stamps[0]) : 0;
}

/// EuRoC's stamps are whole nanoseconds between commas. Others tell by their size, or are seconds,
/// unless only nanoseconds make a sensor's steps of them.
StampUnit unit_of(const std::vector<TextLine>& lines, const ImuColumns& columns) {
  if (columns.unit) return *columns.unit;
  const auto fields = fields_of(lines.front().text);
  const bool has_commas = lines.front().text.find(',') != std::string_view::npos;
  if (columns.stamp >= fields.size()) return StampUnit::kSeconds;
  const std::string_view word = fields[columns.stamp];
  constexpr std::size_t kFewestDigits = 9;
  const bool may_be_ns = word.size() >= kFewestDigits && word.find('.') == std::string_view::npos;
  if (has_commas && may_be_ns) return StampUnit::kNanoseconds;
  const auto is_sensors = [&](StampUnit unit) {
    return is_sensors_interval(first_step_s(lines, columns.stamp, unit));
  };
  const StampUnit unit = unit_of_stamps({{lines.front().number, fields}}, columns.stamp);
  const bool is_ns = may_be_ns && !is_sensors(unit) && is_sensors(StampUnit::kNanoseconds);
  return is_ns ? StampUnit::kNanoseconds : unit;
}

std::vector<ImuSample> in_order(std::vector<ImuRow> rows, const std::string& name) {
  const auto before = [](const ImuRow& a, const ImuRow& b) {
    return a.sample.stamp < b.sample.stamp;
  };
  const auto unsorted = std::is_sorted_until(rows.begin(), rows.end(), before);
  if (unsorted != rows.end()) {
    log::warn("{}:{}: stamps go back; readings are sorted by their stamps", name, unsorted->line);
    std::stable_sort(rows.begin(), rows.end(), before);
  }
  std::vector<ImuSample> samples;
  for (const ImuRow& row : rows)
    if (samples.empty() || samples.back().stamp < row.sample.stamp) samples.push_back(row.sample);
  if (samples.size() < rows.size())
    log::warn("{}: {} readings have the stamp of another and are left out", name,
              rows.size() - samples.size());
  return samples;
}

Result<std::vector<ImuSample>> parse(std::string_view text, const std::string& name,
                                     Sensor sensor) {
  if (Status status = check_is_text(text, name); !status) return status.error();
  if (Status status = check_line_ends(text, name); !status) return status.error();
  std::vector<TextLine> lines = data_lines(text);
  if (lines.empty()) return fault_in(name, 0, "no readings");
  std::optional<ImuColumns> named = columns_of_header(text, lines.front().number);
  const auto first = fields_of(lines.front().text);
  if (std::none_of(first.begin(), first.end(), [](auto word) { return parse_number(word); })) {
    named = columns_named(lines.front().text);
    if (!named)
      return fault_in(name, lines.front().number,
                      "the header does not name a stamp and three accelerations");
    lines.erase(lines.begin());
    if (lines.empty()) return fault_in(name, 0, "no readings");
  }
  if (has_decimal_commas(lines.front().text))
    return fault_in(name, lines.front().number, "decimal commas; write points");
  ImuColumns columns;
  if (named && named->count == fields_of(lines.front().text).size()) {
    columns = *named;
  } else {
    const Result<ImuColumns> placed = columns_by_place(lines.front(), name);
    if (!placed.ok()) return placed.error();
    columns = *placed;
  }
  if (sensor == Sensor::kImu && !columns.has_gyro())
    return fault_in(name, lines.front().number, "an accelerometer alone; no angular velocity");
  const StampUnit unit = unit_of(lines, columns);
  std::vector<ImuRow> rows;
  rows.reserve(lines.size());
  for (const TextLine& line : lines) {
    Result<ImuRow> row = row_of(line, columns, unit, name);
    if (!row.ok()) return row.error();
    rows.push_back(std::move(*row));
  }
  std::vector<ImuSample> samples = in_order(std::move(rows), name);
  if (const std::string fault = fault_of_intervals(samples); !fault.empty())
    return fault_in(name, 0, fmt::format("{}, if stamps are {}", fault, name_of(unit)));
  const ImuDoubt doubt = doubt_about(samples, columns.has_gyro());
  if (doubt.is_fault) return fault_in(name, 0, doubt.what);
  if (!doubt.what.empty()) log::warn("{}: {}", name, doubt.what);
  return samples;
}

}  // namespace

Result<std::vector<ImuSample>> parse_imu(std::string_view text, const std::string& name) {
  return parse(text, name, Sensor::kImu);
}

Result<std::vector<ImuSample>> read_imu(const std::filesystem::path& path) {
  const Result<std::string> text = read_file(path, kLargestImuFile_bytes);
  if (!text.ok()) return text.error();
  return parse_imu(*text, path.string());
}

Result<std::vector<AccelerometerSample>> parse_accelerometer(std::string_view text,
                                                             const std::string& name) {
  const Result<std::vector<ImuSample>> samples = parse(text, name, Sensor::kAccelerometer);
  if (!samples.ok()) return samples.error();
  std::vector<AccelerometerSample> out;
  out.reserve(samples->size());
  for (const ImuSample& sample : *samples)
    out.push_back({sample.stamp, sample.specific_force_mps2});
  return out;
}

Result<std::vector<AccelerometerSample>> read_accelerometer(const std::filesystem::path& path) {
  const Result<std::string> text = read_file(path, kLargestImuFile_bytes);
  if (!text.ok()) return text.error();
  return parse_accelerometer(*text, path.string());
}

std::string format_imu(std::span<const ImuSample> samples) {
  std::string out(kEurocHeader);
  for (const ImuSample& sample : samples) {
    const Vec3 &w = sample.angular_velocity_radps, &a = sample.specific_force_mps2;
    fmt::format_to(std::back_inserter(out), "{},{},{},{},{},{},{}\n", sample.stamp.ns, w.x(), w.y(),
                   w.z(), a.x(), a.y(), a.z());
  }
  return out;
}

}  // namespace ygslam
