#include "app/inspect_output.hpp"

#include <cstdio>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "app/point_picture.hpp"
#include "app/standard_streams.hpp"
#include "eval/mot_text.hpp"
#include "eval/tracking_report.hpp"
#include "io/atomic_file.hpp"

namespace ygslam {
namespace {

std::string percent(double share) {
  char text[16];
  std::snprintf(text, sizeof text, "%.1f %%", 100 * share);
  return text;
}

/// Only the full system knows objects by their masks.
bool has_objects(const Check& check) { return check.name == "full"; }

TrackingScore score_objects(const Check& check) {
  std::vector<SimilarityFrame> frames;
  for (const BoxFrame& frame : check.objects) frames.push_back(compare(frame));
  return score_tracking(frames);
}

}  // namespace

Status write_tracks(const std::filesystem::path& out, const std::vector<Check>& checks) {
  for (const Check& check : checks) {
    if (!has_objects(check)) continue;
    for (const auto& [name, boxes] : {std::pair("tracks.txt", &BoxFrame::tracked),
                                      std::pair("tracks_truth.txt", &BoxFrame::truth)}) {
      Status written = write_file_atomically(out / name, mot_text(check.objects, boxes));
      if (!written.ok()) return written;
    }
  }
  return Ok{};
}

Status write_pictures(const std::filesystem::path& out, const std::vector<Check>& checks) {
  cv::Mat sheet;
  for (const auto& [number, first] : checks.front().pictures) {
    cv::Mat row, column;
    for (const Check& check : checks) {
      const auto at = check.pictures.find(number);
      const cv::Mat picture = at != check.pictures.end() ? at->second : first;
      cv::Mat small;
      cv::resize(picture, small, {}, 0.5, 0.5, cv::INTER_AREA);
      row.empty() ? row = picture : (cv::hconcat(row, picture, row), row);
      column.empty() ? column = small : (cv::vconcat(column, small, column), column);
    }
    char name[32];
    std::snprintf(name, sizeof name, "frame_%06u.jpg", number);
    Status written = write_jpeg(out / name, row);
    if (!written.ok()) return written;
    sheet.empty() ? sheet = column : (cv::hconcat(sheet, column, sheet), sheet);
  }
  return sheet.empty() ? Status(Ok{}) : write_jpeg(out / "checks.jpg", sheet);
}

nlohmann::ordered_json checks_json(const std::vector<Check>& checks, bool has_truth) {
  nlohmann::ordered_json json;
  json["truth"] = has_truth;
  json["checks"] = nlohmann::ordered_json::array();
  for (const Check& check : checks) {
    nlohmann::ordered_json one{{"name", check.name}};
    if (has_truth) {
      one["precision"] = check.points.precision();
      one["recall"] = check.points.recall();
      one["found"] = check.points.found;
      one["missed"] = check.points.missed;
      one["false_alarms"] = check.points.false_alarms;
      one["standing"] = check.points.standing;
      one["left_out"] = check.points.left_out;
      if (check.mask.either > 0) one["mask_iou"] = check.mask.iou();
    }
    if (has_objects(check)) one["objects"] = to_json(score_objects(check));
    json["checks"].push_back(one);
  }
  return json;
}

void print_checks(const std::vector<Check>& checks, bool has_truth) {
  if (!has_truth) {
    std::printf("no mask/ beside the sequence: no truth to compare with\n");
    return;
  }
  std::printf("%-10s %10s %10s %10s %10s %12s %10s %10s %10s\n", "check", "precision", "recall",
              "found", "missed", "false alarms", "standing", "left out", "mask IoU");
  for (const Check& check : checks) {
    std::printf("%-10s %10s %10s %10zu %10zu %12zu %10zu %10zu %10s\n", check.name.c_str(),
                percent(check.points.precision()).c_str(), percent(check.points.recall()).c_str(),
                check.points.found, check.points.missed, check.points.false_alarms,
                check.points.standing, check.points.left_out,
                check.mask.either > 0 ? percent(check.mask.iou()).c_str() : "-");
  }
  for (const Check& check : checks)
    if (has_objects(check)) print_text(format_tracking(score_objects(check)));
}

}  // namespace ygslam
