// What loop closing did in a run, from its loops.csv: which stage refused which places, and, where
// the true trajectory is known, which of them were true.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "io/trajectory.hpp"

namespace ygslam {

/// A line of loops.csv: a keyframe compared with a place.
struct LoopRow {
  Timestamp stamp, place_stamp;
  int keyframe = 0;
  int place = 0;
  std::string stage;  ///< where it ended: the verdict of a refused place, else the outcome
  int inliers = 0;
  double contradiction = 0;
  double path_m = 0;
  double correction_m = 0;
  double correction_rad = 0;
  int agreeing = 0;
  double stretch = 0;  ///< in standard deviations
};

/// By the true trajectory: how far apart the two cameras stood.
struct TrueView {
  double apart_m = 0;
  double turned_rad = 0;  ///< between the optical axes
  /// Near enough to see the same things.
  [[nodiscard]] bool same_place() const;
};

struct JudgedLoop {
  LoopRow row;
  std::optional<TrueView> truth;  ///< none where the true trajectory has no pose
};

inline constexpr const char* kClosedStage = "closed";
/// All stages, in the order in which a place goes through them.
[[nodiscard]] std::span<const char* const> loop_stages();

/// @return kInput naming file, line and fault: no such column, not a number, no such stage.
[[nodiscard]] Result<std::vector<LoopRow>> read_loops(const std::filesystem::path& file);

/// @param truth in order of time; may be empty. @param max_diff_s between stamps that belong
/// together.
[[nodiscard]] std::vector<JudgedLoop> judge_loops(std::span<const LoopRow> rows,
                                                  std::span<const StampedPose> truth,
                                                  double max_diff_s);

/// Two tables: places by stage, and the loops that were closed.
[[nodiscard]] std::string format_loops(std::span<const JudgedLoop> loops, bool has_truth);
[[nodiscard]] nlohmann::ordered_json loops_json(std::span<const JudgedLoop> loops, bool has_truth);

}  // namespace ygslam
