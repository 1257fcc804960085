// An estimate judged against the truth: everything `eval` prints and metrics.json holds.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "eval/alignment.hpp"
#include "eval/error_series.hpp"
#include "eval/hand_eye.hpp"
#include "eval/trajectory_errors.hpp"

namespace ygslam {

struct EvalOptions {
  AlignMode align = AlignMode::kSe3;
  double max_diff_s = 0.02;  ///< association
  std::size_t rpe_frames = 30;
  double rpe_seconds = 1.0;
  bool has_stamps = true;  ///< false: poses are numbered, nothing is said about seconds
  bool same_body = false;  ///< true: no constant transform between truth and estimate is looked for
  WFirst w_first = {};     ///< of what files quaternions were read so
  bool mirrored_truth = false;  ///< the truth is that of a camera with y up (ICL-NUIM)
};

struct RpeReport {
  Statistics trans_m, rot_deg;
};

/// The truth is that of another body than the estimate's camera (eval/hand_eye.hpp).
struct BodyReport {
  SE3 T_body_camera;
  Statistics ate_m;  ///< of the camera; EvalReport::ate_m compares the positions as given
  Statistics ate_rot_deg_as_given;
  std::optional<RpeReport> rpe_frames_as_given, rpe_seconds_as_given;
};

struct EvalReport {
  Statistics ate_m;
  Statistics ate_rot_deg;               ///< orientation error after the same alignment
  std::optional<RpeReport> rpe_frames;  ///< nothing where the trajectory is too short
  std::optional<RpeReport> rpe_seconds;
  EvalOptions options;
  double scale = 1.0;  ///< found by the Sim(3) alignment, else 1
  std::size_t pairs = 0;
  double span_s = 0;  ///< first to last pair
  std::optional<double> coverage;
  /// Nothing where truth and estimate are of one body. Where it is told, the RPE and the
  /// orientation errors are those of the camera.
  std::optional<BodyReport> body;
  std::vector<std::string> truth_notes;  ///< what was found about the truth; among the warnings too
  std::vector<std::string> warnings;
};

/// Associates, aligns and measures. RPE goes over all pairs of poses `rpe_frames` apart, and over
/// all pairs whose distance in time is nearest to `rpe_seconds` (within max_diff_s or half a frame
/// interval, whichever is more, so that a gap makes no false pair).
/// @param frames stamps of all frames, for the coverage; empty: none is told.
/// @return kInput if no stamps overlap.
[[nodiscard]] Result<EvalReport> evaluate(std::span<const StampedPose> truth,
                                          std::span<const StampedPose> estimate,
                                          const EvalOptions& options = {},
                                          std::span<const Timestamp> frames = {});

struct Evaluation {
  EvalReport report;
  ErrorSeries series;
};
/// The same with the errors of every pose.
[[nodiscard]] Result<Evaluation> evaluate_in_detail(std::span<const StampedPose> truth,
                                                    std::span<const StampedPose> estimate,
                                                    const EvalOptions& options = {},
                                                    std::span<const Timestamp> frames = {});

/// The stamps of a file's first column: associations.txt, rgb.txt, a trajectory, or frames.csv
/// (comma-separated, with a line of column names of which one is `stamp`). In order of time.
/// @return kInput naming file and line.
[[nodiscard]] Result<std::vector<Timestamp>> read_frame_stamps(const std::filesystem::path& path);

/// As `eval --json` prints one estimate: ate, ate_rot_deg, rpe (null where too short), alignment,
/// ...
[[nodiscard]] nlohmann::json to_json(const EvalReport& report);
[[nodiscard]] nlohmann::json to_json(const Statistics& statistics);

/// For people: a heading, a table, the warnings.
[[nodiscard]] std::string format_report(const EvalReport& report, const std::string& name);

struct NamedReport {
  std::string name;
  EvalReport report;
};
/// Several estimates against the same truth, one line each; the best of each column is marked.
/// @param reports at least one, all with the same options.
[[nodiscard]] std::string format_comparison(std::span<const NamedReport> reports);

}  // namespace ygslam
