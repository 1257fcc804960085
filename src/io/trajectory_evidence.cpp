#include "io/trajectory_evidence.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>

#include "io/text.hpp"
#include "io/trajectory_checks.hpp"

namespace ygslam {
namespace {

using Pose = PoseColumns::Pose;
using Stamp = PoseColumns::Stamp;

constexpr std::size_t kMostExamined = 2000;  // lines: the first and the last of a long file
constexpr std::size_t kImageNameColumn = 9;  // of COLMAP
// So much of the lines must bear a reading out; the rest are faults that are told by line.
constexpr double kLeastShare = 0.5;
constexpr double kIncreasingShare = 0.9;

Error refused(const std::string& where, const std::string& what) {
  return {ErrorKind::kInput, where + ": " + what};
}

std::string place_of(const std::string& name, int line) {
  return name + ":" + std::to_string(line);
}

std::vector<double> numbers_of(const PoseRecord& record) {
  std::vector<double> values;
  for (const std::string_view field : record.fields)
    values.push_back(parse_number(field).value_or(std::nan("")));
  return values;
}

// A spread of the records with the usual number of fields, as numbers.
struct Sample {
  std::size_t columns = 0;  ///< the most common number of fields
  std::vector<std::vector<double>> rows;
  std::vector<const PoseRecord*> records;

  template <typename Fits>
  [[nodiscard]] double share(const Fits& fits) const {
    const auto count = std::count_if(rows.begin(), rows.end(), fits);
    return rows.empty() ? 0 : static_cast<double>(count) / static_cast<double>(rows.size());
  }
  /// Of the steps from line to line.
  template <typename Fits>
  [[nodiscard]] double share_of_steps(const Fits& fits) const {
    std::size_t count = 0;
    for (std::size_t i = 1; i < rows.size(); ++i) count += fits(rows[i - 1], rows[i]) ? 1 : 0;
    return rows.size() < 2 ? 1 : static_cast<double>(count) / static_cast<double>(rows.size() - 1);
  }
};

std::size_t usual_columns(const std::vector<PoseRecord>& records) {
  std::map<std::size_t, std::size_t> counts;
  for (const PoseRecord& record : records) ++counts[record.fields.size()];
  const auto most =
      std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) {
        return std::pair(a.second, a.first) < std::pair(b.second, b.first);
      });
  return most->first;
}

// Lines that follow each other directly, so that steps mean something: the first and the last.
Sample sample_of(const std::vector<PoseRecord>& records) {
  Sample sample;
  sample.columns = usual_columns(records);
  const std::size_t part = kMostExamined / 2;
  const bool all = records.size() <= kMostExamined;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (!all && i >= part && i + part < records.size()) continue;
    if (records[i].fields.size() != sample.columns) continue;
    sample.rows.push_back(numbers_of(records[i]));
    sample.records.push_back(&records[i]);
  }
  return sample;
}

// Whether a field is a name, and not a number that is missing or not finite.
bool is_text(std::string_view field) {
  std::string word(field.substr(0, std::min<std::size_t>(field.size(), 4)));
  std::transform(word.begin(), word.end(), word.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return word.find("nan") == std::string::npos && word.find("inf") == std::string::npos &&
         word.find("null") == std::string::npos && !parse_number(field);
}

// Columns of text (frame ids, names of images) hold no pose.
std::vector<std::size_t> columns_of_numbers(const Sample& sample) {
  std::vector<std::size_t> columns;
  for (std::size_t c = 0; c < sample.columns; ++c) {
    const bool all_text = std::all_of(sample.records.begin(), sample.records.end(),
                                      [c](const auto* r) { return is_text(r->fields[c]); });
    if (!all_text) columns.push_back(c);
  }
  return columns;
}

Sample only_columns(const Sample& sample, const std::vector<std::size_t>& columns) {
  Sample kept = sample;
  kept.columns = columns.size();
  for (auto& row : kept.rows) {
    std::vector<double> values;
    for (const std::size_t c : columns) values.push_back(row[c]);
    row = std::move(values);
  }
  return kept;
}

bool is_unit(const std::vector<double>& row, std::size_t at) {
  if (at + 4 > row.size()) return false;
  const double squares = row[at] * row[at] + row[at + 1] * row[at + 1] + row[at + 2] * row[at + 2] +
                         row[at + 3] * row[at + 3];
  return std::abs(std::sqrt(squares) - 1) < kQuaternionTolerance;
}

// @param stride between the rows of the matrix, step between its columns.
bool is_rotation_at(const std::vector<double>& row, std::size_t at, std::size_t stride,
                    std::size_t step) {
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = i; j < 3; ++j) {
      double dot = 0;
      for (std::size_t k = 0; k < 3; ++k)
        dot += row[at + i * stride + k * step] * row[at + j * stride + k * step];
      if (!(std::abs(dot - (i == j ? 1 : 0)) < kRotationTolerance)) return false;
    }
  }
  return true;
}

bool is_matrix(const std::vector<double>& row, std::size_t at, Pose pose) {
  const std::size_t size = pose == Pose::kMatrix3x4 ? 12 : 16;
  if (at + size > row.size() || !is_rotation_at(row, at, 4, 1)) return false;
  if (pose == Pose::kMatrix3x4) return true;
  const bool by_columns = pose == Pose::kMatrix4x4ByColumns;
  for (std::size_t k = 0; k < 4; ++k) {
    const double value = by_columns ? row[at + 4 * k + 3] : row[at + 12 + k];
    if (!(std::abs(value - (k == 3 ? 1 : 0)) < 1e-6)) return false;
  }
  return true;
}

bool increases(const Sample& sample, std::size_t at) {
  return sample.share_of_steps([at](const auto& a, const auto& b) { return a[at] < b[at]; }) >=
         kIncreasingShare;
}

bool is_whole(const Sample& sample, std::size_t at) {
  return sample.share([at](const auto& row) { return row[at] == std::floor(row[at]); }) == 1;
}

bool counts(const Sample& sample, std::size_t at) {
  return is_whole(sample, at) && sample.share_of_steps([at](const auto& a, const auto& b) {
    return b[at] == a[at] + 1;
  }) >= kIncreasingShare;
}

bool is_split_stamp(const Sample& sample, std::size_t at) {
  return is_whole(sample, at) && is_whole(sample, at + 1) &&
         sample.share([at](const auto& row) { return row[at + 1] >= 0 && row[at + 1] < 1e9; }) ==
             1 &&
         sample.share_of_steps([at](const auto& a, const auto& b) {
           return a[at] < b[at] || (a[at] == b[at] && a[at + 1] < b[at + 1]);
         }) >= kIncreasingShare &&
         // Nanoseconds are large numbers, and not in step with the lines.
         sample.share([at](const auto& row) { return row[at + 1] >= 1e5; }) >= kLeastShare;
}

PoseColumns quaternion_from(std::size_t position_at) {
  PoseColumns columns;
  for (std::size_t i = 0; i < 3; ++i) columns.position_at[i] = position_at + i;
  for (std::size_t i = 0; i < 4; ++i) columns.quaternion_at[i] = position_at + 3 + i;
  return columns;
}

struct PoseReading {
  PoseColumns columns;
  std::string title;
};

void add_matrices(const Sample& sample, std::vector<PoseReading>& found) {
  const auto add = [&](std::size_t columns, Pose pose, const char* title) {
    const std::size_t at = columns % 4 == 0 ? 0 : 1;
    if (sample.columns != columns ||
        sample.share([&](const auto& row) { return is_matrix(row, at, pose); }) < kLeastShare)
      return;
    PoseColumns layout;
    layout.pose = pose;
    layout.stamp = at == 0 ? Stamp::kNone : Stamp::kNumber;
    layout.matrix_at = at;
    found.push_back({layout, title});
  };
  add(12, Pose::kMatrix3x4, "KITTI (3x4 matrices, no stamps)");
  add(13, Pose::kMatrix3x4, "stamp and 3x4 matrix");
  add(16, Pose::kMatrix4x4, "4x4 matrices, no stamps");
  add(16, Pose::kMatrix4x4ByColumns, "4x4 matrices column by column, no stamps");
  add(17, Pose::kMatrix4x4, "stamp and 4x4 matrix");
  add(17, Pose::kMatrix4x4ByColumns, "stamp and 4x4 matrix column by column");
}

// How many columns of stamp stand before the position, and what they are.
void add_quaternions(const Sample& sample, std::vector<PoseReading>& found) {
  const auto fits = [&](std::size_t before) {
    return sample.columns >= before + 7 &&
           sample.share([&](const auto& row) { return is_unit(row, before + 3); }) >= kLeastShare;
  };
  const auto add = [&](std::size_t before, Stamp stamp, std::size_t stamp_at, const char* title) {
    PoseColumns layout = quaternion_from(before);
    layout.stamp = stamp;
    layout.stamp_at = stamp_at;
    layout.nanoseconds_at = stamp_at + 1;
    found.push_back({layout, title});
  };
  if (sample.columns == 7 && fits(0)) add(0, Stamp::kNone, 0, "x y z qx qy qz qw, no stamps");
  if (fits(1)) add(1, Stamp::kNumber, 0, "");
  if (fits(2) && counts(sample, 0) && increases(sample, 1))
    add(2, Stamp::kNumber, 1, "number, stamp, x y z qx qy qz qw");
  if (fits(2) && is_split_stamp(sample, 0))
    add(2, Stamp::kSecondsAndNanoseconds, 0, "seconds, nanoseconds, x y z qx qy qz qw");
  if (fits(3) && counts(sample, 0) && is_split_stamp(sample, 1))
    add(3, Stamp::kSecondsAndNanoseconds, 1, "number, seconds, nanoseconds, x y z qx qy qz qw");
}

std::string column_range(std::size_t first) {
  return std::to_string(first + 1) + " to " + std::to_string(first + 4);
}

std::string what_stands_there(const Sample& sample) {
  std::string text = std::to_string(sample.columns) + " columns";
  for (std::size_t at = 0; at + 4 <= sample.columns; ++at) {
    if (sample.share([at](const auto& row) { return is_unit(row, at); }) < kLeastShare) continue;
    return text + ", of which " + column_range(at) + " have unit length as a quaternion has";
  }
  if (sample.columns == 8) {
    double squares = 0;
    for (std::size_t i = 4; i < 8; ++i) squares += sample.rows[0][i] * sample.rows[0][i];
    std::array<char, 64> length{};
    std::snprintf(length.data(), length.size(), "%.3g", std::sqrt(squares));
    return text + ", of which " + column_range(4) + " are no unit quaternion (length " +
           length.data() + ")";
  }
  return text + ", with no unit quaternion and no rotation matrix in the same place of each";
}

Error no_format(const std::string& name, const PoseRecord& record, const std::string& found) {
  return refused(place_of(name, record.line), found + "; " + accepted_trajectories());
}

// EuRoC's tables have no other mark where the header is gone: commas and whole nanoseconds.
bool is_euroc(const PoseText& poses, const Sample& sample, std::string_view first_line) {
  constexpr std::size_t kLeastDigits = 12;
  const auto& fields = poses.records.front().fields;
  const std::string_view stamp = fields.empty() ? std::string_view() : fields.front();
  return first_line.find(',') != std::string_view::npos && stamp.size() >= kLeastDigits &&
         std::all_of(stamp.begin(), stamp.end(), [](char c) { return c >= '0' && c <= '9'; }) &&
         sample.columns >= 8;
}

// Which of two readings that both fit is meant; nothing if that cannot be told.
std::optional<PoseReading> choose(const Sample& sample, std::vector<PoseReading> found) {
  const auto is_matrix_reading = [](const PoseReading& c) {
    return c.columns.pose != Pose::kQuaternion;
  };
  if (std::any_of(found.begin(), found.end(), is_matrix_reading))
    std::erase_if(found, [&](const PoseReading& c) { return !is_matrix_reading(c); });
  if (found.size() == 1) return found.front();
  const bool are_matrices = is_matrix_reading(found.front());
  if (are_matrices) {  // by rows and by columns: the same only where nothing turns
    const std::size_t at = found.front().columns.matrix_at;
    const bool symmetric = sample.share([at](const auto& row) {
      return row[at + 1] == row[at + 4] && row[at + 2] == row[at + 8] && row[at + 6] == row[at + 9];
    }) == 1;
    return symmetric ? std::optional(found.front()) : std::nullopt;
  }
  // TUM with further columns needs a first column that is a time, not a count of lines.
  std::erase_if(found, [&](const PoseReading& c) {
    return c.title.empty() && (!increases(sample, 0) || counts(sample, 0));
  });
  return found.size() == 1 ? std::optional(found.front()) : std::nullopt;
}

void shift_columns(const std::vector<std::size_t>& kept, PoseColumns& columns) {
  for (std::size_t& at : columns.position_at) at = kept[at];
  for (std::size_t& at : columns.quaternion_at) at = kept[at];
  columns.nanoseconds_at =
      columns.stamp == Stamp::kSecondsAndNanoseconds ? kept[columns.nanoseconds_at] : 0;
  columns.stamp_at = kept[columns.stamp_at];
  columns.matrix_at = kept[columns.matrix_at];
}

Result<PoseText> by_evidence(PoseText poses, const std::string& name, std::string_view first_line) {
  const Sample whole = sample_of(poses.records);
  const auto kept = columns_of_numbers(whole);
  const Sample sample = only_columns(whole, kept);
  std::vector<PoseReading> found;
  add_matrices(sample, found);
  add_quaternions(sample, found);
  const PoseRecord& first = *whole.records.front();
  if (found.empty()) return no_format(name, first, what_stands_there(sample));
  const auto chosen = choose(sample, found);
  if (!chosen) {
    return no_format(name, first,
                     std::to_string(sample.columns) + " columns that can be read in " +
                         std::to_string(found.size()) + " ways");
  }
  poses.columns = chosen->columns;
  poses.taken_for = chosen->title;
  const StampUnit unit = unit_of_stamps(poses.records, 0);
  const bool may_be_ns = unit == StampUnit::kSeconds || unit == StampUnit::kNanoseconds;
  if (chosen->title.empty() && may_be_ns && is_euroc(poses, whole, first_line)) {
    poses.columns.quaternion_at = {5, 6, 7, 4};
    poses.columns.unit = StampUnit::kNanoseconds;
    poses.taken_for = "EuRoC (quaternion with w first)";
    return poses;
  }
  shift_columns(kept, poses.columns);
  if (chosen->title.empty() && kept.front() != 0) poses.taken_for = "TUM after a column of text";
  if (poses.taken_for.empty() && whole.columns > 8)
    poses.taken_for = "TUM, columns beyond the 8th left out";
  return poses;
}

std::string listed(const std::array<std::size_t, 4>& columns) {
  std::string text;
  for (const std::size_t c : columns) text += (text.empty() ? "" : ", ") + std::to_string(c + 1);
  return text;
}

// The header's word counts where the quaternions bear it out.
Result<PoseText> by_header(PoseText poses, const std::string& name) {
  const auto& at = poses.columns.quaternion_at;
  const auto fits = std::count_if(poses.records.begin(), poses.records.end(), [&](const auto& r) {
    return std::abs(quaternion_length(r, at) - 1) < kQuaternionTolerance;
  });
  if (static_cast<double>(fits) < kLeastShare * static_cast<double>(poses.records.size())) {
    return refused(
        place_of(name, poses.records.front().line),
        "columns " + listed(at) + ", which the header names qx qy qz qw, are no unit quaternion");
  }
  const PoseColumns tum = quaternion_from(1);
  const bool is_tum = poses.columns.stamp == Stamp::kNumber && poses.columns.stamp_at == 0 &&
                      poses.columns.position_at == tum.position_at && at == tum.quaternion_at;
  if (is_tum) return poses;
  poses.taken_for = "columns as the header names them, quaternion x y z w in " + listed(at);
  if (poses.columns.stamp == Stamp::kNone) poses.taken_for += ", no stamps";
  return poses;
}

// The last comment before the data.
std::string_view last_comment(std::string_view text, int first_data_line) {
  std::string_view comment;
  for (int number = 1; number < first_data_line && !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    if (line.starts_with('#') && line.size() > 1) comment = line;
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  const std::size_t name = std::min(comment.find_first_not_of("# \t"), comment.size());
  return comment.substr(name);
}

std::vector<std::string_view> header_names(std::string_view line) {
  if (line.find_first_of(",;") != std::string_view::npos) return csv_fields(line);
  auto names = words_of(line);
  std::erase_if(names, [](std::string_view word) { return word.front() == '['; });  // units
  return names;
}

bool has_numbers(std::string_view line) {
  const auto words = words_of(line, ",;");
  return std::any_of(words.begin(), words.end(),
                     [](std::string_view word) { return parse_number(word).has_value(); });
}

std::vector<PoseRecord> records_of(const std::vector<TextLine>& lines, bool keeps_empty_fields) {
  std::vector<PoseRecord> records;
  records.reserve(lines.size());
  for (const TextLine& line : lines) {
    const bool is_csv =
        keeps_empty_fields && line.text.find_first_of(",;") != std::string_view::npos;
    records.push_back({line.number, is_csv ? csv_fields(line.text) : words_of(line.text, ",;")});
  }
  return records;
}

// TUM's own order, anywhere among other words of a comment.
bool is_tum_order(const PoseColumns& columns) {
  const std::size_t first = columns.position_at[0];
  const PoseColumns tum = quaternion_from(first);
  return columns.stamp == Stamp::kNumber && columns.stamp_at + 1 == first &&
         columns.position_at == tum.position_at && columns.quaternion_at == tum.quaternion_at;
}

// @return nothing where no header names the columns.
Result<std::optional<PoseText>> with_header(std::string_view text, std::vector<TextLine> lines,
                                            const std::string& name) {
  const bool is_data = !has_numbers(lines.front().text);
  const int line = lines.front().number;
  const std::string_view header = is_data ? lines.front().text : last_comment(text, line);
  const auto names = header_names(header);
  const auto columns = columns_of_names(names);
  if (!columns.ok()) return refused(place_of(name, line), columns.error().message);
  if (is_data && !*columns) {
    return refused(place_of(name, line), "'" + printable(header, 40) +
                                             "' names no columns x y z "
                                             "qx qy qz qw; " +
                                             accepted_trajectories());
  }
  if (!*columns) return std::optional<PoseText>();
  if (is_data) lines.erase(lines.begin());
  if (lines.empty()) return refused(name, "no pose in the file");
  PoseText poses{records_of(lines, true), **columns, {}};
  const std::size_t found = usual_columns(poses.records);
  if (found == names.size()) {
    auto read = by_header(std::move(poses), name);
    if (!read.ok()) return read.error();
    return std::optional(std::move(*read));
  }
  if (!is_data && is_tum_order(**columns)) return std::optional<PoseText>();  // a remark
  return refused(
      place_of(name, lines.front().number),
      std::to_string(found) + " columns, the header names " + std::to_string(names.size()));
}

// Matrices over several lines of four numbers, as Open3D and 7-Scenes write them.
Result<std::optional<PoseText>> with_blocks(const std::vector<TextLine>& lines,
                                            const std::string& name) {
  const auto count = [&](std::size_t i) { return words_of(lines[i].text, ",;").size(); };
  const std::size_t head = count(0) == 3 && lines.size() > 4 && count(1) == 4 ? 1 : 0;
  if (lines.size() <= head || count(head) != 4) return std::optional<PoseText>();
  const auto is_last_row = [&](std::size_t i) {
    const auto words = words_of(lines[i].text, ",;");
    return words.size() == 4 && parse_number(words[0]) == 0.0 && parse_number(words[1]) == 0.0 &&
           parse_number(words[2]) == 0.0 && parse_number(words[3]) == 1.0;
  };
  const bool has_last_row = lines.size() >= head + 4 && is_last_row(head + 3);
  const std::size_t rows = has_last_row ? 4 : 3;
  PoseText poses;
  for (std::size_t i = 0; i < lines.size(); i += head + rows) {
    PoseRecord record{lines[i].number, {}};
    for (std::size_t k = head; k < head + rows; ++k) {
      if (i + k >= lines.size() || count(i + k) != 4) {
        return refused(place_of(name, record.line),
                       "a matrix of which line " + std::to_string(k - head + 1) + " of " +
                           std::to_string(rows) + " has not 4 numbers");
      }
      const auto words = words_of(lines[i + k].text, ",;");
      record.fields.insert(record.fields.end(), words.begin(), words.end());
    }
    poses.records.push_back(std::move(record));
  }
  const int first_line = lines.front().number;
  auto read = by_evidence(std::move(poses), name, "");
  if (!read.ok() || read->columns.pose == Pose::kQuaternion) {
    return refused(
        place_of(name, first_line),
        "lines of 4 numbers that are no 3x4 or 4x4 matrices; " + accepted_trajectories());
  }
  read->taken_for = head == 1
                        ? "4x4 matrices with a line of numbers before each (Open3D), no stamps"
                    : rows == 4 ? "4x4 matrices in four lines each, no stamps"
                                : "3x4 matrices in three lines each, no stamps";
  return std::optional(std::move(*read));
}

bool is_colmap_pose(const PoseRecord& record) {
  if (record.fields.size() <= kImageNameColumn || parse_number(record.fields[kImageNameColumn]))
    return false;
  for (std::size_t i = 0; i < kImageNameColumn; ++i) {
    if (!parse_number(record.fields[i])) return false;
  }
  return std::abs(quaternion_length(record, {2, 3, 4, 1}) - 1) < kQuaternionTolerance;
}

// COLMAP's images.txt: a line `id qw qx qy qz tx ty tz camera name`, then one of image points.
std::optional<PoseText> as_colmap(const std::vector<TextLine>& lines) {
  PoseText poses;
  for (const TextLine& line : lines) {
    PoseRecord record{line.number, words_of(line.text)};
    if (is_colmap_pose(record)) {
      poses.records.push_back(std::move(record));
    } else if (record.fields.size() % 3 != 0 || poses.records.empty() ||
               !std::all_of(record.fields.begin(), record.fields.end(),
                            [](auto word) { return parse_number(word).has_value(); })) {
      return std::nullopt;
    }
  }
  if (poses.records.empty()) return std::nullopt;
  poses.columns.position_at = {5, 6, 7};
  poses.columns.quaternion_at = {2, 3, 4, 1};
  poses.columns.is_camera_from_world = true;
  poses.columns.stamp_at = kImageNameColumn;
  poses.columns.stamp = Stamp::kImageName;
  poses.taken_for = "COLMAP images.txt (poses of the world in the camera: turned round)";
  return poses;
}

}  // namespace

std::string accepted_trajectories() {
  return "read are `stamp x y z qx qy qz qw` (TUM), EuRoC, 3x4 or 4x4 matrices (KITTI, Replica), "
         "COLMAP, or a header line that names the columns (docs/inputs.md)";
}

Result<PoseText> recognise_poses(std::string_view text, const std::string& name) {
  const auto lines = data_lines(text);
  if (lines.empty()) return refused(name, "no pose in the file");
  if (auto colmap = as_colmap(lines)) return std::move(*colmap);
  auto headed = with_header(text, lines, name);
  if (!headed.ok()) return headed.error();
  if (*headed) return std::move(**headed);
  auto blocks = with_blocks(lines, name);
  if (!blocks.ok()) return blocks.error();
  if (*blocks) return std::move(**blocks);
  return by_evidence({records_of(lines, false), {}, {}}, name, lines.front().text);
}

}  // namespace ygslam
