#include "eval/report.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "core/log.hpp"  // brings {fmt}: numbers look the same in every locale
#include "eval/hand_eye.hpp"
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

// Times that are not seconds make no difference to pairs, but to all that is over a second.
void warn_of_steps(const PosePairs& pairs, EvalReport& report) {
  constexpr std::size_t kFewest = 10;
  constexpr double kSlowest_s = 4;  // keyframes may be as far apart
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  const auto& poses = pairs.estimate;
  if (!report.options.has_stamps || poses.size() < kFewest) return;
  const double step_s = median_interval_s(poses);
  const bool are_numbers =
      step_s == 1 && std::all_of(poses.begin(), poses.end(), [](const StampedPose& pose) {
        return pose.stamp.ns % kSecond_ns == 0;
      });
  if (!are_numbers && step_s < kSlowest_s) return;
  report.warnings.push_back(fmt::format(
      "poses are {:g} s apart: are the stamps {}? RPE over {:g} s takes them as seconds", step_s,
      are_numbers ? "numbers of frames" : "milliseconds (--stamps ms)",
      report.options.rpe_seconds));
}

// "1305031102.1 to 1305031130.2"
std::string range_text(std::span<const StampedPose> poses) {
  if (poses.empty()) return "none";
  return format_stamp(poses.front().stamp, 1) + " to " + format_stamp(poses.back().stamp, 1) + " s";
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

// What a constant transform between the truth's body and the camera changes, in words.
std::string body_warning(const EvalReport& report) {
  const BodyReport& body = *report.body;
  std::string text = fmt::format(
      "the truth is of a body turned by {:.1f} deg against the camera and offset by {:.3f} m: "
      "taken "
      "out of RPE and rotation errors",
      body.T_body_camera.angle() * 180 / std::numbers::pi, body.T_body_camera.t().norm());
  if (body.rpe_frames_as_given && report.rpe_frames) {
    text += fmt::format(" (RPE over {} frames as given {:.4f} m, {:.2f} deg)",
                        report.options.rpe_frames, body.rpe_frames_as_given->trans_m.rmse,
                        body.rpe_frames_as_given->rot_deg.rmse);
  }
  return text + fmt::format("; ATE is of the positions as given ({:.4f} m with it taken out)",
                            body.ate_m.rmse);
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

nlohmann::json body_json(const BodyReport& body) {
  const Eigen::Quaterniond q = body.T_body_camera.quaternion();
  const Vec3& t = body.T_body_camera.t();
  return {{"turn_deg", body.T_body_camera.angle() * 180 / std::numbers::pi},
          {"offset_m", t.norm()},
          {"T_body_camera", {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}},
          {"ate", to_json(body.ate_m)},
          {"as_given",
           {{"ate_rot_deg", to_json(body.ate_rot_deg_as_given)},
            {"rpe",
             {{"frames30", rpe_json(body.rpe_frames_as_given)},
              {"sec1", rpe_json(body.rpe_seconds_as_given)}}}}}};
}

void move_by(const Alignment& alignment, std::vector<StampedPose>& poses) {
  for (StampedPose& pose : poses) pose.T_world_camera = alignment.apply(pose.T_world_camera);
}

// Distances of the positions from their mean.
std::vector<double> path_radii(std::span<const StampedPose> poses) {
  Vec3 mean = Vec3::Zero();
  for (const StampedPose& pose : poses)
    mean += pose.T_world_camera.t() / static_cast<double>(poses.size());
  std::vector<double> radii_m;
  for (const StampedPose& pose : poses) radii_m.push_back((pose.T_world_camera.t() - mean).norm());
  return radii_m;
}

// All errors of pairs that belong to one body.
void measure(const EvalOptions& options, Evaluation& evaluation) {
  ErrorSeries& series = evaluation.series;
  EvalReport& report = evaluation.report;
  series.absolute = absolute_errors(series.pairs);
  report.ate_m = summarize(series.absolute.trans_m);
  report.ate_rot_deg = summarize(series.absolute.rot_deg);
  series.frames =
      measure_rpe(series.pairs, frame_intervals(series.pairs.size(), options.rpe_frames));
  report.rpe_frames = summarize_rpe(series.frames);
  series.seconds = measure_rpe(series.pairs, second_intervals(series.pairs, options));
  report.rpe_seconds = summarize_rpe(series.seconds);
}

// Rotation errors and RPE anew with the truth as that of the camera; ATE and the positions stay.
// @param estimate before its alignment, with its scale corrected.
void take_out_body(const SE3& T_body_camera, std::vector<StampedPose> estimate,
                   Evaluation& evaluation) {
  Evaluation of_camera;
  of_camera.series.pairs = {evaluation.series.pairs.truth, std::move(estimate)};
  PosePairs& pairs = of_camera.series.pairs;
  for (StampedPose& pose : pairs.truth) pose.T_world_camera = pose.T_world_camera * T_body_camera;
  EvalReport& report = evaluation.report;
  const bool has_scale = report.options.align == AlignMode::kSim3;
  move_by(align(pairs, has_scale ? AlignMode::kSe3 : report.options.align), pairs.estimate);
  measure(report.options, of_camera);
  report.body = BodyReport{T_body_camera, of_camera.report.ate_m, report.ate_rot_deg,
                           report.rpe_frames, report.rpe_seconds};
  report.ate_rot_deg = of_camera.report.ate_rot_deg;
  report.rpe_frames = of_camera.report.rpe_frames;
  report.rpe_seconds = of_camera.report.rpe_seconds;
  evaluation.series.absolute.rot_deg = std::move(of_camera.series.absolute.rot_deg);
  evaluation.series.frames = std::move(of_camera.series.frames);
  evaluation.series.seconds = std::move(of_camera.series.seconds);
  report.truth_notes.push_back(body_warning(report));
}

std::string rpe_text(const EvalReport& report) {
  if (!report.rpe_frames) return {};
  return fmt::format(" and {:.4f} m, {:.2f} deg of RPE", report.rpe_frames->trans_m.rmse,
                     report.rpe_frames->rot_deg.rmse);
}

// The truth of ICL-NUIM is that of a camera whose y points up, written as if it pointed down.
void warn_of_mirror(std::span<const StampedPose> truth, std::span<const StampedPose> estimate,
                    EvalReport& report) {
  EvalOptions options = report.options;
  options.mirrored_truth = true;
  const auto other = evaluate(truth, estimate, options);
  if (!other.ok()) return;
  report.truth_notes.push_back(fmt::format(
      "the truth is mirrored, as that of ICL-NUIM with its fy < 0: ATE {:.4f} m{}, read "
      "as a mirror's {:.4f} m{}: use --mirrored-truth",
      report.ate_m.rmse, rpe_text(report), other->ate_m.rmse, rpe_text(*other)));
}

// Positions in millimetres or centimetres: the scale between both says so where they fit with it.
// @return what to say, empty if nothing.
std::string unit_warning(PosePairs pairs) {
  constexpr double kRoundly = 0.05;
  constexpr double kFits = 0.2;  // of the path's extent
  const Alignment with_scale = align(pairs, AlignMode::kSim3);
  for (const auto& [factor, unit] : {std::pair{1000.0, "millimetres"}, {100.0, "centimetres"}}) {
    const bool of_truth = std::abs(with_scale.scale / factor - 1) < kRoundly;
    const bool of_estimate = std::abs(with_scale.scale * factor - 1) < kRoundly;
    if (!of_truth && !of_estimate) continue;
    const double extent_m = summarize(path_radii(pairs.truth)).rmse;
    move_by(with_scale, pairs.estimate);
    if (summarize(absolute_errors(pairs).trans_m).rmse > kFits * extent_m) return {};
    return fmt::format("the positions of the {} seem to be {}, which are read as metres",
                       of_truth ? "truth" : "estimate", unit);
  }
  return {};
}

std::string reading_text(PoseReading reading) {
  switch (reading) {
    case PoseReading::kWFirst:
      return "quaternions with qw first (a header line `# stamp x y z qw qx qy qz` tells)";
    case PoseReading::kWLast:
      return "quaternions with qw last (a header line `# stamp x y z qx qy qz qw` tells)";
    case PoseReading::kInverse:
      return "poses of the world in the camera, T_camera_world (to be inverted)";
    case PoseReading::kInverseWFirst:
      return "poses of the world in the camera, T_camera_world, with qw first";
    case PoseReading::kAsRead:
      break;
  }
  return "what was read";
}

// Files say nothing of the order of their quaternions, nor of whose pose in what they are.
void warn_of_reading(const BetterReading& better, std::span<const StampedPose> truth,
                     std::span<const StampedPose> estimate, EvalReport& report) {
  EvalOptions options = report.options;
  options.mirrored_truth = false;  // it is done
  const auto other = better.fits_truth
                         ? evaluate(read_otherwise(truth, better.reading), estimate, options)
                         : evaluate(truth, read_otherwise(estimate, better.reading), options);
  if (!other.ok()) return;
  const char* whose = better.fits_truth && better.fits_estimate ? "the truth or the estimate"
                      : better.fits_truth                       ? "the truth"
                                                                : "the estimate";
  report.truth_notes.push_back(
      fmt::format("{} seems to have {}: ATE {:.4f} m{} as read, {:.4f} m{} so", whose,
                  reading_text(better.reading), report.ate_m.rmse, rpe_text(report),
                  other->ate_m.rmse, rpe_text(*other)));
}

}  // namespace

Result<Evaluation> evaluate_in_detail(std::span<const StampedPose> given_truth,
                                      std::span<const StampedPose> estimate,
                                      const EvalOptions& options,
                                      std::span<const Timestamp> frames) {
  std::vector<StampedPose> turned;
  if (options.mirrored_truth) turned = mirrored(given_truth);
  const std::span<const StampedPose> truth = options.mirrored_truth ? turned : given_truth;
  Evaluation evaluation;
  PosePairs& pairs = evaluation.series.pairs;
  pairs = associate(truth, estimate, options.max_diff_s);
  if (pairs.size() == 0) {
    return Error{ErrorKind::kInput,
                 "no stamps of estimate and truth lie within the largest "
                 "difference of " +
                     format_stamp({to_ns(options.max_diff_s)}, 3) + " s (truth " +
                     range_text(truth) + ", estimate " + range_text(estimate) + ")"};
  }
  const std::string unit = unit_warning(pairs);
  const Alignment alignment = align(pairs, options.align);
  move_by({SE3(), alignment.scale}, pairs.estimate);
  std::vector<StampedPose> scaled = pairs.estimate;
  const BetterReading better = better_reading(pairs, options.w_first);
  const bool is_misread = better.reading != PoseReading::kAsRead;
  const bool is_mirror = !is_misread && is_mirrored(pairs);
  const auto T_body_camera =
      options.same_body || is_mirror || is_misread ? std::nullopt : find_body_offset(pairs);
  move_by({alignment.T_truth_estimate, 1.0}, pairs.estimate);
  EvalReport& report = evaluation.report;
  report.options = options;
  report.scale = alignment.scale;
  report.pairs = pairs.size();
  report.span_s = seconds_between(pairs.truth.back().stamp, pairs.truth.front().stamp);
  measure(options, evaluation);
  if (!frames.empty()) report.coverage = coverage(frames, estimate, options.max_diff_s);
  add_warnings(alignment, truth, report);
  warn_of_steps(pairs, report);
  if (report.coverage && *report.coverage == 0)
    report.warnings.push_back("no pose lies at one of the stamps of all frames (" +
                              format_stamp(frames.front(), 1) + " to " +
                              format_stamp(frames.back(), 1) + " s): other clocks, or units?");
  if (T_body_camera) take_out_body(*T_body_camera, std::move(scaled), evaluation);
  if (is_mirror && !options.mirrored_truth) warn_of_mirror(given_truth, estimate, report);
  if (!unit.empty()) report.truth_notes.push_back(unit);
  if (is_misread) warn_of_reading(better, truth, estimate, report);
  report.warnings.insert(report.warnings.end(), report.truth_notes.begin(),
                         report.truth_notes.end());
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
  if (report.options.mirrored_truth) json["mirrored_truth"] = true;
  if (report.body) json["body"] = body_json(*report.body);
  if (report.coverage) json["coverage"] = *report.coverage;
  return json;
}

}  // namespace ygslam
