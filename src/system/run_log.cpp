#include "system/run_log.hpp"

#include <algorithm>
#include <cmath>

#include "core/log.hpp"

namespace ygslam {
namespace {

void log_shutter(const ShutterReport& report, const std::string& source) {
  constexpr double kMs = 1e3;
  const std::string in_use = fmt::format("{:.1f} ms ({})", kMs * report.in_use_s,
                                         source.empty() ? "told by the caller" : source);
  constexpr double kSame_s = 1e-4;
  if (report.taken_over && std::abs(report.times.colour_readout_s - report.readout_s) > kSame_s) {
    log::info(
        "the rows of an image are read over time ({:.1f} +- {:.1f} ms measured): the published "
        "times of a {} are used, {:.1f} ms for colour and {:.1f} ms for depth, also in the map",
        kMs * report.readout_s, kMs * report.std_s, source, kMs * report.times.colour_readout_s,
        kMs * report.times.depth_readout_s);
  } else if (report.taken_over) {
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

void RunLog::miss(Timestamp stamp) {
  constexpr double kLostAfter_s = 0.5;  // as of black images
  ++outcome_.statistics.missed;
  if (!first_missed_) first_missed_ = stamp;
  const Timestamp since = last_processed_.value_or(*first_missed_);
  if (lost_ || seconds_between(stamp, since) > kLostAfter_s) lose(*first_missed_, stamp);
}

/// Until `last` there is no pose; if there was one before, from `first` on.
void RunLog::lose(Timestamp first, Timestamp last) {
  RunStatistics& s = outcome_.statistics;
  const bool is_new = !std::exchange(lost_, true);
  s.lost_interval_count += is_new ? 1 : 0;
  if (s.lost_interval_count > kMostIntervalsTold) return;
  if (is_new) s.lost_intervals.emplace_back(first, last);
  s.lost_intervals.back().second = std::max(s.lost_intervals.back().second, last);
}

/// Once a run, when it has been there for so long that it has been seen as a whole.
void RunLog::tell_of_mask(const FrameRecord& record, const TrackResult& result) {
  constexpr double kAfter_s = 2, kWorthTelling = 0.002;
  RunStatistics& s = outcome_.statistics;
  if (!result.ego_mask) {
    s.ego_mask_share = 0;
    masked_since_.reset();
    return;
  }
  if (result.ego_mask != told_mask_) s.ego_mask_share = covered_share(result.ego_mask);
  told_mask_ = result.ego_mask;
  if (!masked_since_) masked_since_ = record.stamp;
  if (mask_told_ || s.ego_mask_share < kWorthTelling) return;
  if (seconds_between(record.stamp, *masked_since_) < kAfter_s) return;
  mask_told_ = true;
  log::info(
      "something fixed to the camera covers {:.1f} % of the image, {}: it is left out ({} in the "
      "camera file says so from the start)",
      100 * s.ego_mask_share, place_in_image(*result.ego_mask), "`ignore`");
}

void RunLog::add(const FrameRecord& record, const TrackResult& result) {
  if (result.shutter) {
    log_shutter(*result.shutter, shutter_found_ ? "" : shutter_source_);
    shutter_found_ |= result.shutter->taken_over;
  }
  early_frames_.add(record, result);
  if (keep_trajectory_)
    for (const RetrackedFrame& frame : result.retracked) retracked_.emplace_back(frame);
  tell_of_mask(record, result);
  RunStatistics& s = outcome_.statistics;
  ++s.frames;
  if (record.has_pose()) {
    ++s.tracked;
    if (keep_trajectory_) outcome_.trajectory.emplace_back(record);
  }
  s.coasting += record.state == TrackState::kCoasting ? 1 : 0;
  s.few_static += record.few_static ? 1 : 0;
  record.state == TrackState::kLost ? lose(record.stamp, record.stamp) : void(lost_ = false);
  last_processed_ = record.stamp;
  first_missed_.reset();
  if (record.mask_age_frames >= 0) s.mask_age_frames.add(record.mask_age_frames);
  s.track.wall_ms.add(record.track_ms);
  s.track.cpu_ms.add(record.track_cpu_ms);
  s.orb_ms.add(record.orb_ms);
  s.motion_ms.add(record.motion_ms);
  s.pose_ms.add(record.pose_ms);
  for (const FrameSink& sink : sinks_) sink(record, result);
}

}  // namespace ygslam
