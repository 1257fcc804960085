// Reports for people: one estimate in full, several side by side.
#include <algorithm>
#include <array>
#include <functional>

#include "core/log.hpp"  // brings {fmt}
#include "eval/report.hpp"

namespace ygslam {
namespace {

std::string row(const char* name, const Statistics& s) {
  return fmt::format("  {:<22} {:10.6f} {:10.6f} {:10.6f} {:10.6f} {:10.6f} {:10.6f} {:7}\n", name,
                     s.rmse, s.mean, s.median, s.std, s.min, s.max, s.count);
}

std::string span_text(const EvalReport& report) {
  return report.options.has_stamps ? fmt::format(" over {:.2f} s", report.span_s) : " by line";
}

constexpr double kPrintedDifference = 5e-7;  // less is not seen in the table

// A column of the comparison: smaller is better.
struct Column {
  const char* title;
  std::function<std::optional<double>(const EvalReport&)> value;
};

std::optional<double> rmse_of(const std::optional<RpeReport>& rpe, Statistics RpeReport::*part) {
  if (!rpe) return std::nullopt;
  return ((*rpe).*part).rmse;
}

const std::array<Column, 8>& columns() {
  static const std::array<Column, 8> table = {{
      {"ATE rmse", [](const EvalReport& r) { return std::optional(r.ate_m.rmse); }},
      {"median", [](const EvalReport& r) { return std::optional(r.ate_m.median); }},
      {"max [m]", [](const EvalReport& r) { return std::optional(r.ate_m.max); }},
      {"rot. [deg]", [](const EvalReport& r) { return std::optional(r.ate_rot_deg.rmse); }},
      {"RPE30 [m]", [](const EvalReport& r) { return rmse_of(r.rpe_frames, &RpeReport::trans_m); }},
      {"[deg]", [](const EvalReport& r) { return rmse_of(r.rpe_frames, &RpeReport::rot_deg); }},
      {"RPE1s [m]",
       [](const EvalReport& r) { return rmse_of(r.rpe_seconds, &RpeReport::trans_m); }},
      {"[deg]", [](const EvalReport& r) { return rmse_of(r.rpe_seconds, &RpeReport::rot_deg); }},
  }};
  return table;
}

std::optional<double> best_of(std::span<const NamedReport> reports, const Column& column) {
  std::optional<double> best;
  for (const NamedReport& entry : reports) {
    const auto value = column.value(entry.report);
    if (value && (!best || *value < *best)) best = value;
  }
  return best;
}

// How many columns a UTF-8 name takes: its bytes without the continuation bytes.
std::size_t width_of(const std::string& name) {
  return static_cast<std::size_t>(std::count_if(name.begin(), name.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
}

std::string padded(const std::string& name, std::size_t width) {
  return name + std::string(width - std::min(width, width_of(name)), ' ');
}

}  // namespace

std::string format_report(const EvalReport& report, const std::string& name) {
  std::string text = fmt::format("{}\n  {} pairs{}, alignment {}", name, report.pairs,
                                 span_text(report), name_of(report.options.align));
  if (report.options.align == AlignMode::kSim3) text += fmt::format(", scale {:.5f}", report.scale);
  if (report.coverage) text += fmt::format(", coverage {:.2f} %", 100.0 * *report.coverage);
  text += fmt::format("\n  {:<22} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10} {:>7}\n", "", "rmse",
                      "mean", "median", "std", "min", "max", "n");
  text += row("ATE [m]", report.ate_m) + row("ATE rotation [deg]", report.ate_rot_deg);
  const auto add = [&](const std::optional<RpeReport>& rpe, const char* trans, const char* rot) {
    if (rpe) text += row(trans, rpe->trans_m) + row(rot, rpe->rot_deg);
  };
  add(report.rpe_frames, "RPE 30 frames [m]", "RPE 30 frames [deg]");
  add(report.rpe_seconds, "RPE 1 s [m]", "RPE 1 s [deg]");
  for (const std::string& warning : report.warnings) text += "  warning: " + warning + "\n";
  return text;
}

std::string format_comparison(std::span<const NamedReport> reports) {
  CHECK(!reports.empty());
  std::size_t width = 8;
  for (const NamedReport& entry : reports) width = std::max(width, width_of(entry.name));
  std::string text = fmt::format("{} {:>6}", padded("", width), "pairs");
  for (const Column& column : columns()) text += fmt::format(" {:>11}", column.title);
  text += "\n";
  std::string warnings;
  for (const auto& [name, report] : reports) {
    text += fmt::format("{} {:>6}", padded(name, width), report.pairs);
    for (const Column& column : columns()) {
      const auto value = column.value(report);
      const bool best =
          reports.size() > 1 && value && *value <= *best_of(reports, column) + kPrintedDifference;
      text += value ? fmt::format(" {:>10.6f}{}", *value, best ? '*' : ' ')
                    : fmt::format(" {:>10} ", "-");
    }
    if (report.coverage) text += fmt::format(" {:6.2f} % covered", 100.0 * *report.coverage);
    if (report.options.align == AlignMode::kSim3)
      text += fmt::format(" scale {:.5f}", report.scale);
    while (text.back() == ' ') text.pop_back();
    text += "\n";
    for (const std::string& warning : report.warnings) {
      warnings += "warning: " + name + ": " + warning + "\n";
    }
  }
  return text +
         fmt::format("alignment {}, RMSE unless said otherwise, * the best of its column\n",
                     name_of(reports.front().report.options.align)) +
         warnings;
}

}  // namespace ygslam
