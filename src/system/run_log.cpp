#include "system/run_log.hpp"

#include "core/log.hpp"

namespace ygslam {
namespace {

void log_shutter(const ShutterReport& report, const std::string& source) {
  constexpr double kMs = 1e3;
  const std::string in_use = fmt::format("{:.1f} ms ({})", kMs * report.in_use_s,
                                         source.empty() ? "told by the caller" : source);
  if (report.taken_over) {
    log::info(
        "the camera reads an image in {:.1f} +- {:.1f} ms{}: taken into account, also in the map; "
        "`ygslam calibrate` finds it for whole runs",
        kMs * report.readout_s, kMs * report.std_s,
        report.in_use_s == 0 || source.empty() ? "" : ", not in " + in_use);
  } else {
    log::warn(
        "the camera seems to read an image in {:.1f} +- {:.1f} ms; {} are in use; see `ygslam "
        "calibrate`",
        kMs * report.readout_s, kMs * report.std_s, in_use);
  }
}

}  // namespace

void RunLog::add(const FrameRecord& record, const TrackResult& result) {
  if (result.shutter) {
    log_shutter(*result.shutter, shutter_found_ ? "" : shutter_source_);
    shutter_found_ |= result.shutter->taken_over;
  }
  early_frames_.add(record, result);
  RunStatistics& s = outcome_.statistics;
  ++s.frames;
  if (record.has_pose()) {
    ++s.tracked;
    if (keep_trajectory_) outcome_.trajectory.emplace_back(record);
  }
  s.few_static += record.few_static ? 1 : 0;
  const bool was_lost = std::exchange(lost_, record.state == TrackState::kLost);
  if (lost_ && !was_lost) s.lost_intervals.emplace_back(record.stamp, record.stamp);
  if (lost_) s.lost_intervals.back().second = record.stamp;
  if (record.mask_age_frames >= 0) s.mask_age_frames.add(record.mask_age_frames);
  s.track.wall_ms.add(record.track_ms);
  s.track.cpu_ms.add(record.track_cpu_ms);
  s.orb_ms.add(record.orb_ms);
  s.motion_ms.add(record.motion_ms);
  s.pose_ms.add(record.pose_ms);
  for (const FrameSink& sink : sinks_) sink(record, result);
}

}  // namespace ygslam
