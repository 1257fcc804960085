#include "system/metrics.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>
#include <thread>

#ifndef YGSLAM_VERSION
#error "YGSLAM_VERSION comes from the build"
#endif

namespace ygslam {
namespace {

using Json = nlohmann::ordered_json;

double round_to(double value, double unit) { return std::round(value / unit) * unit; }

// Nearest-rank percentile of sorted values.
double percentile(const std::vector<double>& sorted, double share) {
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
  return sorted[std::clamp<std::size_t>(rank, 1, sorted.size()) - 1];
}

Json summary_ms(std::vector<double> values) {
  if (values.empty()) return nullptr;
  std::sort(values.begin(), values.end());
  const double mean =
      std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  const auto ms = [](double v) { return round_to(v, 0.001); };
  return {{"median", ms(percentile(values, 0.5))},
          {"mean", ms(mean)},
          {"p95", ms(percentile(values, 0.95))},
          {"p99", ms(percentile(values, 0.99))},
          {"max", ms(values.back())},
          {"count", values.size()}};
}

template <typename Get>
std::vector<double> collect(const SlamOutcome& outcome, Get get) {
  std::vector<double> values;
  for (const FrameRecord& record : outcome.frames) values.push_back(get(record));
  return values;
}

double seconds(Timestamp stamp) { return static_cast<double>(stamp.ns) * 1e-9; }

Json lost_intervals(const SlamOutcome& outcome) {
  Json intervals = Json::array();
  const FrameRecord* begin = nullptr;
  const FrameRecord* end = nullptr;
  for (const FrameRecord& record : outcome.frames) {
    if (record.state == TrackState::kLost) {
      if (!begin) begin = &record;
      end = &record;
    } else if (begin) {
      intervals.push_back({seconds(begin->stamp), seconds(end->stamp)});
      begin = nullptr;
    }
  }
  if (begin) intervals.push_back({seconds(begin->stamp), seconds(end->stamp)});
  return intervals;
}

Json mask_age(const SlamOutcome& outcome) {
  std::vector<double> ages;
  for (const FrameRecord& record : outcome.frames) {
    if (record.mask_age_frames >= 0) ages.push_back(record.mask_age_frames);
  }
  if (ages.empty()) return nullptr;
  std::sort(ages.begin(), ages.end());
  return {{"median", percentile(ages, 0.5)}, {"p95", percentile(ages, 0.95)}};
}

double peak_rss_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

Json timing(const SlamOutcome& outcome) {
  return {{"track", summary_ms(collect(outcome, [](const auto& r) { return r.track_ms; }))},
          {"orb", summary_ms(collect(outcome, [](const auto& r) { return r.orb_ms; }))},
          {"motion", summary_ms(collect(outcome, [](const auto& r) { return r.motion_ms; }))},
          {"pose", summary_ms(collect(outcome, [](const auto& r) { return r.pose_ms; }))},
          {"segment", summary_ms(outcome.statistics.segment_ms)},
          {"map", summary_ms(outcome.statistics.map_ms)}};
}

}  // namespace

double coverage(const SlamOutcome& outcome) {
  if (outcome.frames.empty()) return 0;
  const auto tracked = std::count_if(outcome.frames.begin(), outcome.frames.end(),
                                     [](const FrameRecord& r) { return r.has_pose(); });
  return static_cast<double>(tracked) / static_cast<double>(outcome.frames.size());
}

std::string mode_name(DynamicMode mode) {
  switch (mode) {
    case DynamicMode::kOff:
      return "off";
    case DynamicMode::kGeometry:
      return "geometry";
    case DynamicMode::kSemantic:
      return "semantic";
    case DynamicMode::kFull:
      return "full";
  }
  return "?";
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
  const auto tracked = std::count_if(outcome.frames.begin(), outcome.frames.end(),
                                     [](const FrameRecord& r) { return r.has_pose(); });
  const auto few_static = std::count_if(outcome.frames.begin(), outcome.frames.end(),
                                        [](const FrameRecord& r) { return r.few_static; });
  Json json;
  json["frames"] = input.offered;
  json["readable"] = input.readable;
  json["tracked"] = tracked;
  json["coverage"] =
      input.readable ? static_cast<double>(tracked) / static_cast<double>(input.readable) : 0.0;
  json["lost_intervals"] = lost_intervals(outcome);
  json["keyframes"] = map.keyframes().size();
  json["landmarks"] = map.landmark_count();
  json["skipped_images"] = Json::array();
  for (const SkippedImage& skipped : input.skipped) {
    json["skipped_images"].push_back({{"file", skipped.file}, {"reason", skipped.reason}});
  }
  json["dropped"] = input.dropped;
  json["masks_used"] = outcome.statistics.masks_used;
  json["masks_failed"] = outcome.statistics.masks_failed;
  json["mask_wait_s"] = round_to(outcome.statistics.mask_wait_s, 1e-3);
  json["segmenter_silent"] = outcome.statistics.segmenter_silent;
  json["frames_with_few_static_points"] = few_static;
  json["mask_age_frames"] = mask_age(outcome);
  json["timing_ms"] = timing(outcome);
  json["cpu_ms"] = {
      {"track", summary_ms(collect(outcome, [](const auto& r) { return r.track_cpu_ms; }))},
      {"segment", summary_ms(outcome.statistics.segment_cpu_ms)},
      {"map", summary_ms(outcome.statistics.map_cpu_ms)}};
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
