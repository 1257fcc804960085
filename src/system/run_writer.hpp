// The files of a run (contract: "Output of run").
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "dense/static_cloud.hpp"
#include "io/trajectory.hpp"
#include "system/runner.hpp"

namespace ygslam {

/// Final poses of all tracked frames, with the map's corrected keyframes.
[[nodiscard]] std::vector<StampedPose> final_trajectory(const SlamOutcome& outcome, const Map& map);
/// Poses as they were delivered.
[[nodiscard]] std::vector<StampedPose> live_trajectory(const SlamOutcome& outcome);
[[nodiscard]] std::vector<StampedPose> keyframe_trajectory(const Map& map);
/// One line per frame. @param with_times false: the *_ms columns stay empty, so that two
/// deterministic runs give the same bytes.
[[nodiscard]] std::string frames_csv(const SlamOutcome& outcome, int stamp_decimals,
                                     bool with_times);

/// One line per frame and object (see TrackedObject), in the live world frame.
[[nodiscard]] std::string objects_csv(const SlamOutcome& outcome, int stamp_decimals);

/// trajectory.txt, trajectory_live.txt, keyframes.txt, frames.csv, objects.csv and map.ply, each
/// atomically.
[[nodiscard]] Status write_run(const std::filesystem::path& directory, const SlamOutcome& outcome,
                               const MappingStage& mapping, int stamp_decimals, bool with_times);

}  // namespace ygslam
