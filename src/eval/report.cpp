#include "eval/report.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include <utility>

#include "core/log.hpp"  // brings {fmt}: numbers look the same in every locale
#include "io/text.hpp"
#include "io/trajectory_checks.hpp"

namespace ygslam {
namespace {

RelativeSeries measure_rpe(const PosePairs& pairs, IndexPairs intervals) {
  PoseErrors errors = relative_errors(pairs, intervals);
  return {std::move(intervals), std::move(errors)};
}

std::optional<RpeReport> summarize_rpe(const RelativeSeries& series) {
  if (series.intervals.empty()) return std::nullopt;
  return RpeReport{summarize(series.errors.trans_m), summarize(series.errors.rot_deg)};
}

IndexPairs second_intervals(const PosePairs& pairs, const EvalOptions& options) {
  if (!options.has_stamps) return {};
  const double tolerance_s = std::max(options.max_diff_s, 0.5 * median_interval_s(pairs.estimate));
  return time_intervals(pairs.estimate, options.rpe_seconds, tolerance_s);
}

void add_warnings(const Alignment& alignment, std::span<const StampedPose> truth,
                  EvalReport& report) {
  if (alignment.truth_without_extent) {
    report.warnings.push_back(
        "the true camera does not move: rotation left as it is, centroids aligned");
  }
  if (!report.rpe_frames) report.warnings.push_back("too few poses for the RPE over frames");
  if (!report.rpe_seconds && report.options.has_stamps)
    report.warnings.push_back("too short for the RPE over seconds");
  if (report.options.align == AlignMode::kSim3 && std::abs(report.scale - 1.0) > 0.05) {
    report.warnings.push_back("the scale is off by more than 5 %; for RGB-D align with se3");
  }
  const double truth_span_s = seconds_between(truth.back().stamp, truth.front().stamp);
  if (report.span_s < 0.5 * truth_span_s) {
    report.warnings.push_back("the pairs span less than half of the truth's time");
  }
}

nlohmann::json rpe_json(const std::optional<RpeReport>& rpe) {
  if (!rpe) return nullptr;
  return {{"trans_m", to_json(rpe->trans_m)}, {"rot_deg", to_json(rpe->rot_deg)}};
}

// Which column of a header line holds the stamps; nothing if it is no header.
std::optional<std::size_t> stamp_column(const std::vector<std::string_view>& words) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == "stamp" || words[i] == "timestamp" || words[i] == "stamp_s") return i;
  }
  return std::nullopt;
}

}  // namespace

Result<Evaluation> evaluate_in_detail(std::span<const StampedPose> truth,
                                      std::span<const StampedPose> estimate,
                                      const EvalOptions& options,
                                      std::span<const Timestamp> frames) {
  Evaluation evaluation;
  ErrorSeries& series = evaluation.series;
  series.pairs = associate(truth, estimate, options.max_diff_s);
  PosePairs& pairs = series.pairs;
  if (pairs.size() == 0) {
    return Error{ErrorKind::kInput,
                 "no stamps of estimate and truth lie within the largest "
                 "difference of " +
                     format_stamp({to_ns(options.max_diff_s)}, 3) + " s"};
  }
  const Alignment alignment = align(pairs, options.align);
  for (StampedPose& pose : pairs.estimate) {
    pose.T_world_camera = alignment.apply(pose.T_world_camera);
  }
  EvalReport& report = evaluation.report;
  report.options = options;
  report.scale = alignment.scale;
  report.pairs = pairs.size();
  report.span_s = seconds_between(pairs.truth.back().stamp, pairs.truth.front().stamp);
  series.absolute = absolute_errors(pairs);
  report.ate_m = summarize(series.absolute.trans_m);
  report.ate_rot_deg = summarize(series.absolute.rot_deg);
  series.frames = measure_rpe(pairs, frame_intervals(pairs.size(), options.rpe_frames));
  report.rpe_frames = summarize_rpe(series.frames);
  series.seconds = measure_rpe(pairs, second_intervals(pairs, options));
  report.rpe_seconds = summarize_rpe(series.seconds);
  if (!frames.empty()) report.coverage = coverage(frames, estimate, options.max_diff_s);
  add_warnings(alignment, truth, report);
  return evaluation;
}

Result<EvalReport> evaluate(std::span<const StampedPose> truth,
                            std::span<const StampedPose> estimate, const EvalOptions& options,
                            std::span<const Timestamp> frames) {
  auto evaluation = evaluate_in_detail(truth, estimate, options, frames);
  if (!evaluation.ok()) return evaluation.error();
  return std::move(evaluation->report);
}

Result<std::vector<Timestamp>> read_frame_stamps(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text.ok()) return text.error();
  const Status line_ends = check_line_ends(*text, path.string());
  if (!line_ends.ok()) return line_ends.error();
  std::vector<Timestamp> stamps;
  std::size_t column = 0;
  bool first_line = true;
  for (const TextLine& line : data_lines(*text)) {
    const auto words = words_of(line.text, ",;");
    const auto header = std::exchange(first_line, false) ? stamp_column(words) : std::nullopt;
    if (header) {
      column = *header;
      continue;
    }
    if (const auto blanks = words_of(line.text); blanks.size() > 1 && is_decimal_comma(blanks[0])) {
      return Error{ErrorKind::kInput, path.string() + ":" + std::to_string(line.number) +
                                          ": a decimal comma; needs a decimal point"};
    }
    const auto stamp = column < words.size() ? parse_stamp(words[column]) : std::nullopt;
    if (!stamp) {
      return Error{ErrorKind::kInput, path.string() + ":" + std::to_string(line.number) +
                                          ": no stamp in column " + std::to_string(column + 1)};
    }
    stamps.push_back(stamp->stamp);
  }
  if (stamps.empty()) return Error{ErrorKind::kInput, path.string() + ": no frame in the file"};
  std::sort(stamps.begin(), stamps.end());
  stamps.erase(std::unique(stamps.begin(), stamps.end()), stamps.end());
  return stamps;
}

nlohmann::json to_json(const Statistics& s) {
  return {{"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median},
          {"std", s.std},   {"min", s.min},   {"max", s.max}};
}

nlohmann::json to_json(const EvalReport& report) {
  nlohmann::json json = {
      {"ate", to_json(report.ate_m)},
      {"ate_rot_deg", to_json(report.ate_rot_deg)},
      {"rpe", {{"frames30", rpe_json(report.rpe_frames)}, {"sec1", rpe_json(report.rpe_seconds)}}},
      {"alignment", name_of(report.options.align)},
      {"max_diff_s", report.options.max_diff_s},
      {"pairs", report.pairs},
      {"span_s", report.span_s},
      {"warnings", report.warnings},
  };
  if (report.options.align == AlignMode::kSim3) json["scale"] = report.scale;
  if (report.coverage) json["coverage"] = *report.coverage;
  return json;
}

}  // namespace ygslam
