#include "benchmark_runs/results.hpp"

#include <algorithm>

#include "benchmark_runs/run_files.hpp"
#include "core/log.hpp"  // brings {fmt}
#include "core/printable.hpp"
#include "core/statistics.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

// A run whose files are damaged has no figures and is no good one.
RunFigures read_run(const fs::path& folder, const RunRecord& record,
                    std::optional<std::string>& damage) {
  RunFigures run;
  run.status = record.status;
  run.timings_valid = record.timings_valid;
  if (!has_figures(record.status)) return run;
  damage = fault_of_files(folder, record);
  const auto metrics = read_metrics(folder / "metrics.json");
  if (!metrics.ok() && !damage) damage = metrics.error().message.substr(folder.string().size() + 1);
  if (damage) {
    run.status = RunStatus::kFailed;
    return run;
  }
  run.coverage = number_at(*metrics, "/coverage");
  for (const Figure figure : kFigures) {
    run.values[static_cast<std::size_t>(figure)] = number_at(*metrics, info_of(figure).place);
  }
  return run;
}

Result<ResultRow> read_row(const fs::path& folder, const nlohmann::json& sequence,
                           const std::string& mode, int runs, std::vector<std::string>& damaged) {
  ResultRow row;
  row.sequence_id = sequence.at("id");
  row.sequence = sequence.at("name");
  row.kind = sequence.at("kind");
  row.mode = mode;
  for (int number = 1; number <= runs; ++number) {
    const fs::path run = folder / RunKey{row.sequence_id, mode, number}.folder();
    std::error_code code;
    if (!fs::exists(run / "run.json", code)) continue;  // still to come
    const auto record = read_run_record(run / "run.json");
    if (!record.ok()) return record.error();
    std::optional<std::string> damage;
    row.runs.push_back(read_run(run, *record, damage));
    if (damage)
      damaged.push_back(RunKey{row.sequence, mode, number}.folder().string() + ": " + *damage);
  }
  return row;
}

std::string coverage_text(const ResultRow& row) {
  std::optional<double> least;
  for (const RunFigures& run : row.runs) {
    if (run.coverage && (!least || *run.coverage < *least)) least = run.coverage;
  }
  return least ? fmt::format("{:.1f}", 100 * *least) : "-";
}

std::string runs_text(const ResultRow& row) {
  const std::size_t good = row.good_runs();
  return fmt::format("{}/{}{}", good, row.runs.size(), good < row.runs.size() ? " !" : "");
}

// Columns as wide as their widest cell; the first two to the left, numbers to the right.
std::string aligned(const std::vector<std::vector<std::string>>& table) {
  std::vector<std::size_t> widths(table.front().size(), 0);
  for (const auto& line : table) {
    for (std::size_t i = 0; i < line.size(); ++i) widths[i] = std::max(widths[i], line[i].size());
  }
  std::string text;
  for (const auto& line : table) {
    for (std::size_t i = 0; i < line.size(); ++i) {
      text += i < 2 ? fmt::format("{:<{}}  ", line[i], widths[i])
                    : fmt::format("{:>{}}  ", line[i], widths[i]);
    }
    while (text.back() == ' ') text.pop_back();
    text += "\n";
  }
  return text;
}

}  // namespace

const FigureInfo& info_of(Figure figure) {
  static const std::array<FigureInfo, kFigures.size()> table = {{
      {"ate_m", "ATE [m]", "/ate/rmse", 4},
      {"rpe30_m", "RPE 30 frames [m]", "/rpe/frames30/trans_m/rmse", 4},
      {"rpe30_deg", "RPE 30 frames [deg]", "/rpe/frames30/rot_deg/rmse", 3},
      {"rpe1s_m", "RPE 1 s [m]", "/rpe/sec1/trans_m/rmse", 4},
      {"rpe1s_deg", "RPE 1 s [deg]", "/rpe/sec1/rot_deg/rmse", 3},
      {"track_ms", "tracking [ms]", "/timing_ms/track/median", 1},
  }};
  return table[static_cast<std::size_t>(figure)];
}

std::optional<Spread> ResultRow::spread(Figure figure) const {
  std::vector<double> values;
  for (const RunFigures& run : runs) {
    if (const auto value = run.values[static_cast<std::size_t>(figure)]) values.push_back(*value);
  }
  if (values.empty()) return std::nullopt;
  std::sort(values.begin(), values.end());
  return Spread{values.size(), sorted_median(values), values.front(), values.back()};
}

std::size_t ResultRow::good_runs() const {
  return static_cast<std::size_t>(std::count_if(
      runs.begin(), runs.end(), [](const RunFigures& r) { return r.status == RunStatus::kOk; }));
}

bool ResultRow::timings_valid() const {
  return std::all_of(runs.begin(), runs.end(),
                     [](const RunFigures& run) { return run.timings_valid; });
}

Result<Results> read_results(const fs::path& folder) {
  auto sweep = read_sweep_file(folder / "sweep.json");
  if (!sweep.ok()) return sweep.error();
  Results results;
  results.sweep = std::move(*sweep);
  const nlohmann::json& json = results.sweep.json;
  for (const auto& sequence : json.at("sequences")) {
    if (sequence.contains("error") && sequence["error"].is_string()) {
      results.unusable.push_back(sequence.at("name").get<std::string>() + ": " +
                                 sequence["error"].get<std::string>());
      continue;
    }
    for (const auto& mode : json.at("modes")) {
      const auto row =
          read_row(folder, sequence, mode, json["options"]["runs"].get<int>(), results.damaged);
      if (!row.ok()) return row.error();
      if (!row->runs.empty()) results.rows.push_back(*row);
    }
  }
  return results;
}

std::string format_spread(const Spread& s, int decimals) {
  if (s.count == 1) return fmt::format("{:.{}f}", s.median, decimals);
  return fmt::format("{:.{}f} ({:.{}f} to {:.{}f})", s.median, decimals, s.min, decimals, s.max,
                     decimals);
}

nlohmann::ordered_json to_json(const Spread& s) {
  return {{"median", s.median}, {"min", s.min}, {"max", s.max}, {"runs", s.count}};
}

nlohmann::ordered_json to_json(const Results& results) {
  nlohmann::ordered_json json;
  json["rows"] = nlohmann::json::array();
  for (const ResultRow& row : results.rows) {
    nlohmann::ordered_json entry = {{"sequence", row.sequence},
                                    {"kind", row.kind},
                                    {"mode", row.mode},
                                    {"runs", row.runs.size()},
                                    {"good_runs", row.good_runs()},
                                    {"timings_valid", row.timings_valid()}};
    for (const Figure figure : kFigures) {
      const auto spread = row.spread(figure);
      entry[info_of(figure).key] = nullptr;
      if (spread) entry[info_of(figure).key] = to_json(*spread);
    }
    json["rows"].push_back(std::move(entry));
  }
  json["unusable"] = results.unusable;
  json["damaged"] = results.damaged;
  return json;
}

std::string format_results(const Results& results) {
  std::vector<std::vector<std::string>> table(1, {"sequence", "mode"});
  constexpr std::array kShown = {Figure::kAte, Figure::kRpe30Trans, Figure::kRpe30Rot,
                                 Figure::kTrackTime};
  for (const Figure figure : kShown) table[0].emplace_back(info_of(figure).title);
  table[0].insert(table[0].end(), {"tracked [%]", "runs"});
  for (const ResultRow& row : results.rows) {
    std::vector<std::string> line = {
        one_line(row.sequence) + (row.kind == "rendered" ? " (rendered)" : ""), row.mode};
    for (const Figure figure : kShown) {
      const auto spread = row.spread(figure);
      line.push_back(spread ? format_spread(*spread, info_of(figure).decimals) : "-");
      if (figure == Figure::kTrackTime && spread && !row.timings_valid()) line.back() += " ~";
    }
    line.insert(line.end(), {coverage_text(row), runs_text(row)});
    table.push_back(std::move(line));
  }
  std::string text = results.rows.empty() ? "" : aligned(table);
  for (const std::string& line : results.unusable) text += "unusable: " + line + "\n";
  for (const std::string& line : results.damaged) text += "damaged: " + line + "\n";
  if (!results.rows.empty()) text += "medians over the runs that gave a number (least to most)";
  const auto any = [&](auto test) {
    return std::any_of(results.rows.begin(), results.rows.end(), test);
  };
  if (any([](const ResultRow& r) { return r.good_runs() < r.runs.size(); })) {
    text += "; ! some runs failed or were lost";
  }
  if (any([](const ResultRow& r) { return !r.timings_valid(); })) {
    text += "; ~ not alone on the machine";
  }
  return results.rows.empty() ? text : text + "\n";
}

}  // namespace ygslam
