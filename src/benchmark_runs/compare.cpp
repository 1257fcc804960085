#include "benchmark_runs/compare.hpp"

#include <algorithm>
#include <cmath>

#include "core/log.hpp"  // brings {fmt}
#include "core/printable.hpp"

namespace ygslam {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kLeastRuns = 2;  // of one run nobody knows the spread

const ResultRow* find_row(const Results& results, const ResultRow& like) {
  const auto found =
      std::find_if(results.rows.begin(), results.rows.end(), [&](const ResultRow& row) {
        return row.sequence_id == like.sequence_id && row.mode == like.mode;
      });
  return found == results.rows.end() ? nullptr : &*found;
}

ComparedFigure compare_figure(Figure figure, const ResultRow& a, const ResultRow& b) {
  ComparedFigure result;
  result.figure = figure;
  result.a = a.spread(figure);
  result.b = b.spread(figure);
  if (!result.a || !result.b) return result;
  if (result.a->median > 0) result.ratio = result.b->median / result.a->median;
  const bool is_time = figure == Figure::kTrackTime;
  if (result.a->count < kLeastRuns || result.b->count < kLeastRuns ||
      (is_time && !(a.timings_valid() && b.timings_valid()))) {
    return result;
  }
  result.verdict = result.b->max < result.a->min   ? Verdict::kBetter
                   : result.b->min > result.a->max ? Verdict::kWorse
                                                   : Verdict::kSame;
  return result;
}

ComparedRow compare_rows(const ResultRow& a, const ResultRow& b) {
  ComparedRow row{a.sequence,    a.mode, a.good_runs(), a.runs.size(), b.good_runs(),
                  b.runs.size(), {}};
  for (const Figure figure : kFigures) row.figures.push_back(compare_figure(figure, a, b));
  return row;
}

std::string value_text(const nlohmann::json& json, const char* key) {
  if (!json.contains(key) || json[key].is_null()) return "none";
  return json[key].is_string() ? json[key].get<std::string>() : json[key].dump();
}

std::vector<std::string> notes_on(const Results& a, const Results& b) {
  std::vector<std::string> notes;
  for (const std::string& line : a.damaged) notes.push_back("A is damaged: " + line);
  for (const std::string& line : b.damaged) notes.push_back("B is damaged: " + line);
  const auto add = [&](const char* key, const nlohmann::json& in_a, const nlohmann::json& in_b) {
    const std::string text_a = value_text(in_a, key);
    const std::string text_b = value_text(in_b, key);
    if (text_a != text_b) notes.push_back(fmt::format("{}: A {}, B {}", key, text_a, text_b));
  };
  for (const char* key : {"version", "machine"}) add(key, a.sweep.json, b.sweep.json);
  for (const char* key : kComparableKeys) add(key, a.sweep.options, b.sweep.options);
  return notes;
}

std::string ratio_text(const ComparedFigure& figure) {
  if (!figure.ratio) return "-";
  const char* mark = figure.verdict == Verdict::kBetter  ? " better"
                     : figure.verdict == Verdict::kWorse ? " WORSE"
                                                         : "";
  return fmt::format("{:.3f}{}", *figure.ratio, mark);
}

std::string side_text(const std::optional<Spread>& spread, const ComparedFigure& figure) {
  return spread ? format_spread(*spread, info_of(figure.figure).decimals) : "-";
}

// Whether fewer runs came through; a change of how many is told, however good the others are.
bool loses_runs(const ComparedRow& row) {
  return row.good_b * row.runs_a < row.good_a * row.runs_b;
}
bool wins_runs(const ComparedRow& row) { return row.good_b * row.runs_a > row.good_a * row.runs_b; }

std::string row_text(const ComparedRow& row) {
  std::string text = fmt::format("{} {}: good runs A {}/{}, B {}/{}{}\n", one_line(row.sequence),
                                 row.mode, row.good_a, row.runs_a, row.good_b, row.runs_b,
                                 loses_runs(row)  ? " WORSE"
                                 : wins_runs(row) ? " better"
                                                  : "");
  for (const ComparedFigure& figure : row.figures) {
    if (!figure.a && !figure.b) continue;
    text +=
        fmt::format("  {:<20} {:>28} {:>28}   {}\n", info_of(figure.figure).title,
                    side_text(figure.a, figure), side_text(figure.b, figure), ratio_text(figure));
  }
  return text;
}

std::vector<std::string> changes(const Comparison& comparison, Verdict verdict) {
  std::vector<std::string> list;
  for (const ComparedRow& row : comparison.rows) {
    if (verdict == Verdict::kWorse ? loses_runs(row) : wins_runs(row)) {
      list.push_back(fmt::format("{} {}: good runs {}/{} -> {}/{}", row.sequence, row.mode,
                                 row.good_a, row.runs_a, row.good_b, row.runs_b));
    }
    for (const ComparedFigure& figure : row.figures) {
      if (figure.verdict != verdict) continue;
      const FigureInfo& info = info_of(figure.figure);
      list.push_back(fmt::format("{} {}: {} {:.{}f} -> {:.{}f}", row.sequence, row.mode, info.title,
                                 figure.a->median, info.decimals, figure.b->median, info.decimals));
    }
  }
  return list;
}

}  // namespace

std::string_view name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::kBetter:
      return "better";
    case Verdict::kWorse:
      return "worse";
    case Verdict::kSame:
      return "same";
    case Verdict::kUnjudged:
      return "unjudged";
  }
  return "?";
}

Comparison compare(const Results& a, const Results& b) {
  Comparison comparison;
  comparison.notes = notes_on(a, b);
  for (const ResultRow& row : a.rows) {
    if (const ResultRow* other = find_row(b, row)) {
      comparison.rows.push_back(compare_rows(row, *other));
    } else {
      comparison.only_a.push_back(row.sequence + " " + row.mode);
    }
  }
  for (const ResultRow& row : b.rows) {
    if (find_row(a, row) == nullptr) comparison.only_b.push_back(row.sequence + " " + row.mode);
  }
  return comparison;
}

std::string format_comparison(const Comparison& comparison) {
  std::string text;
  for (const std::string& note : comparison.notes) text += "differs: " + note + "\n";
  if (!comparison.rows.empty()) {
    text += fmt::format("  {:<20} {:>28} {:>28}   {}\n", "", "A", "B", "B / A");
  }
  for (const ComparedRow& row : comparison.rows) text += row_text(row);
  for (const std::string& row : comparison.only_a) text += "only in A: " + row + "\n";
  for (const std::string& row : comparison.only_b) text += "only in B: " + row + "\n";
  for (const auto& [title, verdict] :
       {std::pair{"Better", Verdict::kBetter}, {"Worse", Verdict::kWorse}}) {
    const auto list = changes(comparison, verdict);
    text += fmt::format("{}: {}\n", title, list.empty() ? "nothing" : "");
    if (list.empty()) continue;
    text.erase(text.size() - 2, 1);  // no blank at the end of the line
    for (const std::string& line : list) text += "  " + line + "\n";
  }
  return text;
}

Json to_json(const Comparison& comparison) {
  Json json;
  json["notes"] = comparison.notes;
  json["rows"] = Json::array();
  for (const ComparedRow& row : comparison.rows) {
    Json entry = {{"sequence", row.sequence},
                  {"mode", row.mode},
                  {"good_runs", {{"a", row.good_a}, {"b", row.good_b}}},
                  {"runs", {{"a", row.runs_a}, {"b", row.runs_b}}}};
    for (const ComparedFigure& figure : row.figures) {
      Json& cell = entry[info_of(figure.figure).key];
      cell = {
          {"a", nullptr}, {"b", nullptr}, {"ratio", nullptr}, {"verdict", name_of(figure.verdict)}};
      if (figure.a) cell["a"] = to_json(*figure.a);
      if (figure.b) cell["b"] = to_json(*figure.b);
      if (figure.ratio) cell["ratio"] = *figure.ratio;
    }
    json["rows"].push_back(std::move(entry));
  }
  json["only_a"] = comparison.only_a;
  json["only_b"] = comparison.only_b;
  json["better"] = changes(comparison, Verdict::kBetter);
  json["worse"] = changes(comparison, Verdict::kWorse);
  return json;
}

}  // namespace ygslam
