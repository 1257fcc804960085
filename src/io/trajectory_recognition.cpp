#include "io/trajectory_recognition.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "io/text.hpp"
#include "io/trajectory_checks.hpp"
#include "io/trajectory_sample.hpp"

namespace ygslam {
namespace {

using Pose = PoseColumns::Pose;
using Stamp = PoseColumns::Stamp;

constexpr std::size_t kImageNameColumn = 9;  // of COLMAP

Error refused(const std::string& where, const std::string& what) {
  return {ErrorKind::kInput, where + ": " + what};
}

std::string place_of(const std::string& name, int line) {
  return name + ":" + std::to_string(line);
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
  if (static_cast<double>(fits) < kLeastShareOfPoses * static_cast<double>(poses.records.size())) {
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

// How matrices over several lines of four numbers are laid out.
struct BlockLayout {
  std::size_t head = 0;  // lines before each matrix
  std::size_t rows = 4;
};

std::vector<std::string_view> fields_of(const TextLine& line) { return words_of(line.text, ",;"); }

bool is_last_row(const TextLine& line) {
  const auto words = fields_of(line);
  return words.size() == 4 && parse_number(words[0]) == 0.0 && parse_number(words[1]) == 0.0 &&
         parse_number(words[2]) == 0.0 && parse_number(words[3]) == 1.0;
}

// @return nothing where lines are not of four numbers.
std::optional<BlockLayout> block_layout(const std::vector<TextLine>& lines) {
  const auto count = [&](std::size_t i) {
    const auto fields = fields_of(lines[i]);
    const bool are_numbers = std::all_of(fields.begin(), fields.end(), [](std::string_view word) {
      return parse_number(word).has_value();
    });
    return are_numbers ? fields.size() : 0;
  };
  const std::size_t head = count(0) == 3 && lines.size() > 4 && count(1) == 4 ? 1 : 0;
  if (lines.size() <= head || count(head) != 4) return std::nullopt;
  const bool has_last_row = lines.size() >= head + 4 && is_last_row(lines[head + 3]);
  return BlockLayout{head, has_last_row ? 4U : 3U};
}

Result<PoseRecord> block_at(const std::vector<TextLine>& lines, std::size_t begin,
                            const BlockLayout& layout, const std::string& name) {
  PoseRecord record{lines[begin].number, {}};
  for (std::size_t k = 0; k < layout.rows; ++k) {
    const std::size_t at = begin + layout.head + k;
    const auto words = at < lines.size() ? fields_of(lines[at]) : std::vector<std::string_view>();
    if (words.size() != 4) {
      return refused(place_of(name, record.line),
                     "a matrix of which line " + std::to_string(k + 1) + " of " +
                         std::to_string(layout.rows) + " has not 4 numbers");
    }
    record.fields.insert(record.fields.end(), words.begin(), words.end());
  }
  return record;
}

// Matrices over several lines of four numbers, as Open3D and 7-Scenes write them.
Result<std::optional<PoseText>> with_blocks(const std::vector<TextLine>& lines,
                                            const std::string& name) {
  const auto layout = block_layout(lines);
  if (!layout) return std::optional<PoseText>();
  PoseText poses;
  for (std::size_t i = 0; i < lines.size(); i += layout->head + layout->rows) {
    auto record = block_at(lines, i, *layout, name);
    if (!record.ok()) return record.error();
    poses.records.push_back(std::move(*record));
  }
  auto read = by_evidence(std::move(poses), name, "");
  if (!read.ok() || read->columns.pose == Pose::kQuaternion) {
    return refused(
        place_of(name, lines.front().number),
        "lines of 4 numbers that are no 3x4 or 4x4 matrices; " + accepted_trajectories());
  }
  read->taken_for = layout->head == 1
                        ? "4x4 matrices with a line of numbers before each (Open3D), no stamps"
                    : layout->rows == 4 ? "4x4 matrices in four lines each, no stamps"
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

Result<PoseText> recognise_poses(std::string_view text, const std::string& name) {
  const auto lines = data_lines(text);
  if (lines.empty())
    return refused(name, text.empty() ? "the file is empty" : "no pose in the file");
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
