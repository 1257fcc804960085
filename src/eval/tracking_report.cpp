#include "eval/tracking_report.hpp"

#include <algorithm>
#include <cstdio>

namespace ygslam {
namespace {

std::size_t or_zero(const std::map<int, std::size_t>& counts, int id) {
  const auto at = counts.find(id);
  return at == counts.end() ? 0 : at->second;
}

}  // namespace

nlohmann::ordered_json to_json(const TrackingScore& s) {
  nlohmann::ordered_json json{{"hota", s.hota},
                              {"det_a", s.det_a},
                              {"ass_a", s.ass_a},
                              {"idf1", s.idf1},
                              {"id_precision", s.id_precision},
                              {"id_recall", s.id_recall},
                              {"mota", s.mota},
                              {"found", s.found},
                              {"missed", s.missed},
                              {"false_alarms", s.false_alarms},
                              {"id_switches", s.id_switches}};
  json["truth"] = nlohmann::ordered_json::array();
  for (const auto& [id, frames] : s.truth_frames)
    json["truth"].push_back(
        {{"id", id}, {"frames", frames}, {"id_switches", or_zero(s.switches, id)}});
  json["tracked"] = nlohmann::ordered_json::array();
  for (const auto& [id, frames] : s.tracked_frames)
    json["tracked"].push_back(
        {{"id", id}, {"frames", frames}, {"false_alarms", or_zero(s.false_frames, id)}});
  return json;
}

std::string format_tracking(const TrackingScore& s) {
  char text[400];
  std::snprintf(
      text, sizeof text,
      "objects: HOTA %.3f (DetA %.3f, AssA %.3f)  IDF1 %.3f (precision %.3f, recall %.3f)"
      "  MOTA %.3f\n"
      "  boxes found %zu, missed %zu, false alarms %zu; identity switches %zu; %zu ids of "
      "%zu things\n",
      s.hota, s.det_a, s.ass_a, s.idf1, s.id_precision, s.id_recall, s.mota, s.found, s.missed,
      s.false_alarms, s.id_switches, s.tracked_frames.size(), s.truth_frames.size());
  std::string lines = text;
  for (const auto& [id, frames] : s.truth_frames) {
    std::snprintf(text, sizeof text, "  thing %d: %zu frames, %zu identity switches\n", id, frames,
                  or_zero(s.switches, id));
    lines += text;
  }
  return lines;
}

}  // namespace ygslam
