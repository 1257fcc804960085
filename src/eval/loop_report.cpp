#include "eval/loop_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "core/log.hpp"  // brings {fmt}
#include "eval/associate.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr double kSamePlace_m = 3;
constexpr double kSamePlace_rad = std::numbers::pi / 3;
constexpr double kMaxCount = 1e9;
constexpr std::array kStages = {"few matches", "no pose",      "few inliers",  "narrow",
                                "contradicts", "too far",      "other submap", "ambiguous",
                                "alone",       "inconsistent", kClosedStage};

/// The columns that are read, in any order and among others.
enum LoopColumn : std::size_t {
  kStamp,
  kKeyframe,
  kPlace,
  kPlaceStamp,
  kOutcome,
  kVerdict,
  kInliers,
  kContradiction,
  kPath,
  kCorrection,
  kTurn,
  kAgreeing,
  kStretch,
  kLoopColumnCount
};
constexpr std::array<std::string_view, kLoopColumnCount> kLoopColumns = {
    "stamp",         "keyframe", "place",        "place_stamp",    "outcome",  "verdict", "inliers",
    "contradiction", "path_m",   "correction_m", "correction_rad", "agreeing", "stretch"};

/// Like words_of, but with blanks inside of words: "few matches".
std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t comma; (comma = line.find(',')) != std::string_view::npos;
       line.remove_prefix(comma + 1))
    cells.push_back(trimmed(line.substr(0, comma)));
  cells.push_back(trimmed(line));
  return cells;
}

Error loop_fault(const std::filesystem::path& file, int line, const std::string& what) {
  return {ErrorKind::kInput, file.string() + ":" + std::to_string(line) + ": " + what};
}

using ColumnPlaces = std::array<std::size_t, kLoopColumnCount>;  // of the columns in a line

Result<ColumnPlaces> read_header(const std::filesystem::path& file, const TextLine& line) {
  const auto cells = cells_of(line.text);
  ColumnPlaces places{};
  for (std::size_t c = 0; c < kLoopColumnCount; ++c) {
    const auto found = std::find(cells.begin(), cells.end(), kLoopColumns[c]);
    if (found == cells.end())
      return loop_fault(file, line.number, "no column " + std::string(kLoopColumns[c]));
    places[c] = static_cast<std::size_t>(found - cells.begin());
  }
  return places;
}

/// Reads the cells of one line; the first fault is kept.
class LoopRowReader {
 public:
  LoopRowReader(const std::vector<std::string_view>& cells, const ColumnPlaces& places)
      : cells_(cells), places_(places) {}

  [[nodiscard]] std::string_view text(LoopColumn column) const { return cells_[places_[column]]; }
  double number(LoopColumn column) {
    // A place that no way leads to is infinitely far along the map.
    if (text(column) == "inf") return std::numeric_limits<double>::infinity();
    const auto value = parse_number(text(column));
    if (!value) fail(column, "is no number");
    return value.value_or(0);
  }
  int count(LoopColumn column) {
    const double value = number(column);
    if (value == std::floor(value) && value >= 0 && value <= kMaxCount)
      return static_cast<int>(value);
    fail(column, "is no whole number");
    return 0;
  }
  Timestamp stamp(LoopColumn column) {
    const auto parsed = parse_stamp(text(column));
    if (!parsed) fail(column, "is no stamp");
    return parsed ? parsed->stamp : Timestamp{};
  }
  std::string stage() {
    const LoopColumn column = text(kOutcome) == "refused" ? kVerdict : kOutcome;
    const auto found = std::find(kStages.begin(), kStages.end(), text(column));
    if (found == kStages.end()) fail(column, "is no stage of loop closing");
    return std::string(text(column));
  }
  [[nodiscard]] const std::string& fault() const { return fault_; }

 private:
  void fail(LoopColumn column, const char* what) {
    if (fault_.empty())
      fault_ = std::string(kLoopColumns[column]) + " '" + printable(text(column)) + "' " + what;
  }
  const std::vector<std::string_view>& cells_;
  const ColumnPlaces& places_;
  std::string fault_;
};

std::string true_view_text(const std::optional<TrueView>& truth) {
  if (!truth) return fmt::format("{:>8} {:>6}  {}", "-", "-", "-");
  return fmt::format("{:>8.2f} {:>6.1f}  {}", truth->apart_m,
                     truth->turned_rad * 180 / std::numbers::pi,
                     truth->same_place() ? "yes" : "NO");
}

struct StageCount {
  int all = 0;
  int true_places = 0;
  int false_places = 0;
};

std::map<std::string, StageCount> count_stages(std::span<const JudgedLoop> loops) {
  std::map<std::string, StageCount> counts;
  for (const JudgedLoop& loop : loops) {
    StageCount& stage = counts[loop.row.stage];
    ++stage.all;
    if (loop.truth) ++(loop.truth->same_place() ? stage.true_places : stage.false_places);
  }
  return counts;
}

}  // namespace

bool TrueView::same_place() const { return apart_m < kSamePlace_m && turned_rad < kSamePlace_rad; }

std::span<const char* const> loop_stages() { return kStages; }

Result<std::vector<LoopRow>> read_loops(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text.ok()) return text.error();
  const auto lines = data_lines(*text);
  if (lines.empty()) return loop_fault(file, 1, "is empty; needs a line of column names");
  const auto places = read_header(file, lines.front());
  if (!places.ok()) return places.error();
  const std::size_t columns = cells_of(lines.front().text).size();
  std::vector<LoopRow> rows;
  for (const TextLine& line : std::span(lines).subspan(1)) {
    const auto cells = cells_of(line.text);
    if (cells.size() != columns)
      return loop_fault(file, line.number,
                        fmt::format("has {} columns, the header {}", cells.size(), columns));
    LoopRowReader read(cells, *places);
    LoopRow row;
    row.stamp = read.stamp(kStamp);
    row.place_stamp = read.stamp(kPlaceStamp);
    row.keyframe = read.count(kKeyframe);
    row.place = read.count(kPlace);
    row.stage = read.stage();
    row.inliers = read.count(kInliers);
    row.contradiction = read.number(kContradiction);
    row.path_m = read.number(kPath);
    row.correction_m = read.number(kCorrection);
    row.correction_rad = read.number(kTurn);
    row.agreeing = read.count(kAgreeing);
    row.stretch = read.number(kStretch);
    if (!read.fault().empty()) return loop_fault(file, line.number, read.fault());
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<JudgedLoop> judge_loops(std::span<const LoopRow> rows,
                                    std::span<const StampedPose> truth, double max_diff_s) {
  std::vector<Timestamp> stamps;
  for (const StampedPose& pose : truth) stamps.push_back(pose.stamp);
  const auto pose_at = [&](Timestamp stamp) -> const StampedPose* {
    if (stamps.empty()) return nullptr;
    const StampedPose& pose = truth[nearest_stamps(std::span(&stamp, 1), stamps).front()];
    return std::abs(seconds_between(pose.stamp, stamp)) <= max_diff_s ? &pose : nullptr;
  };
  std::vector<JudgedLoop> judged;
  for (const LoopRow& row : rows) {
    judged.push_back({row, std::nullopt});
    const StampedPose* now = pose_at(row.stamp);
    const StampedPose* then = pose_at(row.place_stamp);
    if (!now || !then) continue;
    const SE3& T_world_now = now->T_world_camera;
    const SE3& T_world_then = then->T_world_camera;
    const double cosine = T_world_now.R().col(2).dot(T_world_then.R().col(2));
    judged.back().truth = TrueView{(T_world_now.t() - T_world_then.t()).norm(),
                                   std::acos(std::clamp(cosine, -1.0, 1.0))};
  }
  return judged;
}

std::string format_loops(std::span<const JudgedLoop> loops, bool has_truth) {
  if (loops.empty()) return "no keyframe was compared with a place\n";
  auto counts = count_stages(loops);
  std::string text = fmt::format("{:<14} {:>9}", "ended at", "compared");
  text += has_truth ? fmt::format(" {:>11} {:>12}\n", "true places", "false places") : "\n";
  for (const char* stage : kStages) {
    const StageCount& count = counts[stage];
    text += fmt::format("{:<14} {:>9}", stage, count.all);
    text +=
        has_truth ? fmt::format(" {:>11} {:>12}\n", count.true_places, count.false_places) : "\n";
  }
  if (counts[kClosedStage].all == 0) return text + "\nno loop was closed\n";
  text += fmt::format("\n{:>18} {:>8} {:>6} {:>7} {:>7} {:>9} {:>6} {:>8} {:>7}", "closed at [s]",
                      "keyframe", "place", "inliers", "way [m]", "moved [m]", "[deg]", "agreeing",
                      "stretch");
  text += has_truth ? fmt::format(" {:>8} {:>6}  {}\n", "true [m]", "[deg]", "same place") : "\n";
  for (const JudgedLoop& loop : loops) {
    const LoopRow& row = loop.row;
    if (row.stage != kClosedStage) continue;
    text += fmt::format("{:>18} {:>8} {:>6} {:>7} {:>7.1f} {:>9.3f} {:>6.2f} {:>8} {:>7.2f}",
                        format_stamp(row.stamp, 3), row.keyframe, row.place, row.inliers,
                        row.path_m, row.correction_m, row.correction_rad * 180 / std::numbers::pi,
                        row.agreeing, row.stretch);
    text += has_truth ? " " + true_view_text(loop.truth) + "\n" : "\n";
  }
  return text;
}

nlohmann::ordered_json loops_json(std::span<const JudgedLoop> loops, bool has_truth) {
  nlohmann::ordered_json json{{"truth", has_truth}, {"compared", loops.size()}};
  auto counts = count_stages(loops);
  json["stages"] = nlohmann::ordered_json::object();
  for (const char* stage : kStages) {
    const StageCount& count = counts[stage];
    nlohmann::ordered_json one{{"compared", count.all}};
    if (has_truth) {
      one["true_places"] = count.true_places;
      one["false_places"] = count.false_places;
    }
    json["stages"][stage] = one;
  }
  json["closed"] = nlohmann::ordered_json::array();
  for (const JudgedLoop& loop : loops) {
    const LoopRow& row = loop.row;
    if (row.stage != kClosedStage) continue;
    nlohmann::ordered_json one{{"stamp", format_stamp(row.stamp, 6)},
                               {"keyframe", row.keyframe},
                               {"place", row.place},
                               {"inliers", row.inliers},
                               {"path_m", row.path_m},
                               {"correction_m", row.correction_m},
                               {"correction_deg", row.correction_rad * 180 / std::numbers::pi},
                               {"agreeing", row.agreeing},
                               {"stretch", row.stretch}};
    if (loop.truth) {
      one["true_apart_m"] = loop.truth->apart_m;
      one["true_turned_deg"] = loop.truth->turned_rad * 180 / std::numbers::pi;
      one["same_place"] = loop.truth->same_place();
    }
    json["closed"].push_back(one);
  }
  return json;
}

}  // namespace ygslam
