// What a run leaves behind when its frames are through: its folder's files, the map with its dense
// views, the scene, the recording without people.
#pragma once

#include "app/program_log.hpp"
#include "app/run_loop.hpp"
#include "app/run_plan.hpp"
#include "system/metrics.hpp"

namespace ygslam {

/// Of a run with frames, after process_frames(); also tells what came out.
[[nodiscard]] Status write_outputs(const RunPlan& plan, const RunFacts& facts, ActiveRun& run,
                                   LogFile& log_file);

/// The recording once more, with the final map: --background.
[[nodiscard]] Status draw_background(const RunPlan& plan, ActiveRun& run);

}  // namespace ygslam
