#include "system/metrics.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>
#include <thread>

#include "core/counted.hpp"
#include "core/log.hpp"

#ifndef YGSLAM_VERSION
#error "YGSLAM_VERSION comes from the build"
#endif

namespace ygslam {
namespace {

using Json = nlohmann::ordered_json;

double round_to(double value, double unit) { return std::round(value / unit) * unit; }

Json summary_ms(const Histogram& times) {
  if (times.count() == 0) return nullptr;
  const auto ms = [](double v) { return round_to(v, 0.001); };
  return {{"median", ms(times.percentile(0.5))},
          {"mean", ms(times.mean())},
          {"p95", ms(times.percentile(0.95))},
          {"p99", ms(times.percentile(0.99))},
          {"max", ms(times.max())},
          {"count", times.count()}};
}

double seconds(Timestamp stamp) { return static_cast<double>(stamp.ns) * 1e-9; }

Json lost_intervals(const RunStatistics& statistics) {
  Json intervals = Json::array();
  for (const auto& [first, last] : statistics.lost_intervals)
    intervals.push_back({seconds(first), seconds(last)});
  return intervals;
}

Json mask_age(const Histogram& ages) {
  if (ages.count() == 0) return nullptr;
  return {{"median", std::round(ages.percentile(0.5))}, {"p95", std::round(ages.percentile(0.95))}};
}

double peak_rss_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

}  // namespace

double coverage(const SlamOutcome& outcome) {
  const RunStatistics& s = outcome.statistics;
  const auto offered = static_cast<double>(s.frames + s.missed);
  return offered > 0 ? static_cast<double>(s.tracked) / offered : 0.0;
}

std::string summary_text(const SlamOutcome& outcome, const Map& map, const FrameReaderCounts& input,
                         const RunFacts& facts) {
  const RunStatistics& s = outcome.statistics;
  std::string text = counted(s.frames + s.missed, "frame");
  if (input.dropped > 0) text += fmt::format(", {} dropped (too late)", input.dropped);
  if (s.missed > input.dropped) text += fmt::format(", {} unreadable", s.missed - input.dropped);
  text += fmt::format(", {:.1f} % tracked", 100 * coverage(outcome));
  if (s.coasting > 0) text += fmt::format(" ({} by IMU or wheels alone)", s.coasting);
  if (s.tracked > facts.trajectory_frames)
    text +=
        fmt::format(" ({} frames in a submap never joined)", s.tracked - facts.trajectory_frames);
  return fmt::format("{}, {}, {}, {:.1f} s", text, counted(map.keyframes().size(), "keyframe"),
                     counted(map.landmark_count(), "landmark"), facts.wall_s);
}

const char* version() { return YGSLAM_VERSION; }

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

Json metrics_json(const SlamOutcome& outcome, const Map& map, const FrameReaderCounts& input,
                  const RunFacts& facts) {
  const RunStatistics& s = outcome.statistics;
  Json json;
  json["frames"] = input.offered;
  json["readable"] = input.readable;
  json["tracked"] = s.tracked;
  json["coasting"] = s.coasting;
  json["coverage"] = coverage(outcome);
  json["trajectory_frames"] = facts.trajectory_frames;
  json["unjoined_frames"] = s.tracked - std::min<std::uint64_t>(s.tracked, facts.trajectory_frames);
  json["lost_intervals"] = lost_intervals(s);
  json["lost_interval_count"] = s.lost_interval_count;
  json["keyframes"] = map.keyframes().size();
  json["landmarks"] = map.landmark_count();
  json["skipped_images"] = Json::array();
  for (const SkippedImage& skipped : input.skipped) {
    json["skipped_images"].push_back({{"file", skipped.file}, {"reason", skipped.reason}});
  }
  json["skipped_image_count"] = input.skipped_images;
  json["colour_without_depth"] = input.without_depth;
  json["left_out"] = input.left_out;
  json["dropped"] = input.dropped;
  json["camera_fixed_share"] = round_to(s.ego_mask_share, 1e-4);
  json["masks_used"] = s.masks_used;
  json["masks_by_fallback"] = s.masks_by_fallback;
  json["masks_failed"] = s.masks_failed;
  json["dense_frames_skipped"] = s.dense_skipped;
  json["mask_wait_s"] = round_to(s.mask_wait_s, 1e-3);
  json["segmenter_silent"] = s.segmenter_silent;
  json["frames_with_few_static_points"] = s.few_static;
  json["mask_age_frames"] = mask_age(s.mask_age_frames);
  json["timing_ms"] = {
      {"track", summary_ms(s.track.wall_ms)},     {"orb", summary_ms(s.orb_ms)},
      {"motion", summary_ms(s.motion_ms)},        {"pose", summary_ms(s.pose_ms)},
      {"segment", summary_ms(s.segment.wall_ms)}, {"map", summary_ms(s.map.wall_ms)}};
  json["cpu_ms"] = {{"track", summary_ms(s.track.cpu_ms)},
                    {"segment", summary_ms(s.segment.cpu_ms)},
                    {"map", summary_ms(s.map.cpu_ms)}};
  json["startup_s"] = round_to(facts.startup_s, 1e-3);
  json["wall_s"] = round_to(facts.wall_s, 1e-3);
  json["peak_rss_mb"] = round_to(peak_rss_mb(), 0.1);
  json["seed"] = facts.seed;
  json["mode"] = facts.mode;
  json["segmenter"] = facts.segmenter;
  json["precision"] = facts.precision;
  json["schedule"] = facts.schedule;
  json["version"] = version();
  json["machine"] = {{"processor", processor_name()},
                     {"threads", std::thread::hardware_concurrency()}};
  return json;
}

}  // namespace ygslam
