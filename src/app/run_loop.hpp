// A run while it goes on: frame after frame from the reader through the session to whoever was
// asked for.
#pragma once

#include <memory>
#include <optional>

#include "app/program_log.hpp"
#include "app/run_plan.hpp"
#include "io/trace_writer.hpp"
#include "live/run_view.hpp"
#include "system/map_saver.hpp"
#include "system/run_writer.hpp"

namespace ygslam {

struct ActiveRun {
  std::unique_ptr<TraceWriter> trace;  // null without --trace
  std::unique_ptr<FrameReader> reader;
  std::unique_ptr<MapSaver> map_saver;      // the session's map goes to it
  std::optional<MapIdentity> replaced_map;  ///< that was in its file
  Session session;
  std::optional<FrameFiles> files;
  std::unique_ptr<RunView> view;
  int interrupted_by = 0;
  bool stopped = false;  ///< on the live page
};

/// Opens the session.
/// @param run must stay where it is while its session lives. @return as open_session().
[[nodiscard]] Status open_run(const RunPlan& plan, ActiveRun& run);

/// All frames, to the runner's finish(), unless it ends with an error before.
/// @param log_file takes its place with the first frame. @return the first error; kInput where not
/// one frame could be read.
[[nodiscard]] Status process_frames(const RunPlan& plan, LogFile& log_file, ActiveRun& run);

}  // namespace ygslam
