#include "app/inspect_loops.hpp"

#include <cstdio>

#include "app/standard_streams.hpp"
#include "eval/hand_eye.hpp"
#include "eval/loop_report.hpp"
#include "eval/report.hpp"
#include "io/trajectory_formats.hpp"

namespace ygslam {

Status inspect_loops(const InspectOptions& options) {
  const std::filesystem::path sequence = options.run.sequence;
  std::error_code code;
  if (!std::filesystem::exists(sequence, code))
    return Error{ErrorKind::kInput, sequence.string() + ": is not there"};
  const auto rows = read_loops(std::filesystem::path(options.loops) / "loops.csv");
  if (!rows.ok()) return rows.error();
  std::vector<StampedPose> truth;
  const std::filesystem::path truth_file = sequence / "groundtruth.txt";
  const bool has_truth = std::filesystem::exists(truth_file, code);
  if (has_truth) {
    auto read = read_stamped_trajectory(truth_file);
    if (!read.ok()) return read.error();
    truth = std::move(read).value();
    const auto estimate =
        read_tum_trajectory(std::filesystem::path(options.loops) / "trajectory.txt");
    if (estimate.ok()) truth = truth_of_camera(truth, *estimate, EvalOptions{}.max_diff_s);
  }
  const auto judged = judge_loops(*rows, truth, EvalOptions{}.max_diff_s);
  if (options.json) {
    print_text(loops_json(judged, has_truth).dump(2) + "\n");
    return Ok{};
  }
  print_text(format_loops(judged, has_truth));
  if (!has_truth) std::printf("\nno groundtruth.txt in the sequence: no truth to compare with\n");
  return Ok{};
}

}  // namespace ygslam
