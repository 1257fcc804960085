#include "app/inspect_command.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <span>

#include "app/point_picture.hpp"
#include "app/progress_bar.hpp"
#include "app/run_options.hpp"
#include "app/stop_signal.hpp"
#include "app/truth_images.hpp"
#include "core/log.hpp"
#include "io/atomic_file.hpp"
#include "segment/movable.hpp"
#include "segment/recorded_masks.hpp"

namespace ygslam {
namespace {

// While the system settles its labels do not count.
constexpr std::uint32_t kFirstScored = 10;
constexpr int kPictures = 6;
constexpr std::size_t kMasksLate = 32;

struct InspectOptions {
  RunOptions run;
  std::vector<std::size_t> frames;
  std::vector<std::string> checks{"classic", "improved", "full"};
  bool json = false;
};

/// One way to tell dynamic points, and how it did.
struct Check {
  std::string name;
  SlamConfig config;
  PointCounts points;
  MaskOverlap mask;
  std::map<std::uint32_t, cv::Mat> pictures;
};

Check make_check(const std::string& name, const SlamConfig& base) {
  Check check{name, base, {}, {}, {}};
  DynamicConfig& dynamic = check.config.dynamic;
  dynamic.mode = name == "full" ? DynamicMode::kFull : DynamicMode::kGeometry;
  if (name == "classic") {
    // Harris corners, all vote, the distance to the epipolar line alone decides.
    dynamic.motion.prior = false;
    dynamic.motion.corners = FlowCorners::kHarris;
    dynamic.rigid.enabled = false;
    dynamic.rim.enabled = false;
    dynamic.fusion.ask_neighbours = false;
  }
  return check;
}

std::vector<JudgedPoint> judged_points(const TrackResult& result) {
  std::vector<JudgedPoint> points;
  for (std::size_t i = 0; i < result.features->size(); ++i) {
    points.push_back(
        {result.features->points[i].uv_px, result.labels.label[i] == MotionLabel::kDynamic});
  }
  return points;
}

/// White ring: moves but was not found; black ring: stands but was called dynamic.
void ring_wrong_points(cv::Mat& picture, const std::vector<JudgedPoint>& points,
                       const DynamicTruth& truth) {
  for (const JudgedPoint& point : points) {
    const PointCounts one = count_points(std::span(&point, 1), truth);
    if (one.missed + one.false_alarms == 0) continue;
    const double grey = one.missed ? 255 : 0;
    cv::circle(picture, cv::Point2f(point.uv_px.x(), point.uv_px.y()), 6,
               cv::Scalar(grey, grey, grey), 2, cv::LINE_AA);
  }
}

std::string percent(double share) {
  char text[16];
  std::snprintf(text, sizeof text, "%.1f %%", 100 * share);
  return text;
}

class Inspection {
 public:
  Inspection(const InspectOptions& options, TumSequence sequence)
      : options_(options), sequence_(std::move(sequence)), truth_(sequence_) {
    const std::size_t from = options_.run.from;
    const std::size_t to = std::min(options_.run.to > 0 ? options_.run.to : sequence_.pairs.size(),
                                    sequence_.pairs.size());
    for (const std::size_t frame : options_.frames) shown_.insert(frame);
    for (std::size_t k = 0; options_.frames.empty() && k < kPictures && from < to; ++k)
      shown_.insert(from + (2 * k + 1) * (to - from) / (2 * kPictures));
  }

  [[nodiscard]] bool has_truth() const { return truth_.available(); }

  /// Runs the whole sequence once.
  Status run(Check& check) {
    SessionOptions session_options;
    Status segmenter = parse_segmenter(options_.run, session_options);
    if (!segmenter.ok()) return segmenter;
    session_options.config = check.config;
    session_options.camera = sequence_.camera;
    session_options.deterministic = true;
    auto session = open_session(std::move(session_options));
    if (!session.ok()) return session.error();
    std::unique_ptr<Segmenter> true_masks;
    if (truth_.available()) {
      auto made = make_recorded_segmenter(sequence_.root / "mask");
      if (!made.ok()) return made.error();
      true_masks = std::move(made).value();
    }
    std::map<FrameId, FramePtr> recent;
    const auto movable = movable_classes(check.config.segment.movable);
    FrameReaderConfig reading;
    reading.from = options_.run.from;
    if (options_.run.to > 0) reading.to = options_.run.to;
    reading.depth = check.config.depth;
    FrameReader reader(sequence_, reading);
    ProgressBar progress(reader.counts().offered, spdlog::get_level() > spdlog::level::warn);
    while (auto frame = reader.next()) {
      const TrackResult result = session->runner->process(*frame);
      std::optional<DynamicTruth> truth;
      if (truth_.available()) {
        auto read = truth_.read((*frame)->stamp);
        if (!read.ok()) return read.error();
        truth = std::move(read).value();
        if (index((*frame)->id) >= kFirstScored)
          check.points += count_points(judged_points(result), *truth);
      }
      recent.emplace((*frame)->id, *frame);
      for (const SegmentationPtr& masks : result.masks) {
        if (!true_masks || !recent.contains(masks->frame)) continue;
        const auto wanted = true_masks->segment(*recent.at(masks->frame));
        if (!wanted.ok()) return wanted.error();
        check.mask += overlap(movable_mask(*masks, *movable), movable_mask(*wanted, *movable));
      }
      while (recent.size() > kMasksLate) recent.erase(recent.begin());
      draw(**frame, result, truth, check);
      progress.update(index((*frame)->id) + 1, check.name);
      if (StopSignal::received()) break;
    }
    static_cast<void>(session->runner->finish());
    return Ok{};
  }

 private:
  void draw(const RgbdFrame& frame, const TrackResult& result,
            const std::optional<DynamicTruth>& truth, Check& check) const {
    const std::size_t number = options_.run.from + index(frame.id);
    if (!shown_.contains(number)) return;
    cv::Mat picture = picture_of(frame);
    draw_points(picture, *result.features, result.labels);
    if (truth) ring_wrong_points(picture, judged_points(result), *truth);
    draw_caption(picture, check.name + "  frame " + std::to_string(number) + "  static " +
                              std::to_string(result.labels.static_points) + "  dynamic " +
                              std::to_string(result.labels.dynamic_points) + "  unknown " +
                              std::to_string(result.labels.unknown_points));
    check.pictures.emplace(static_cast<std::uint32_t>(number), std::move(picture));
  }

  const InspectOptions& options_;
  TumSequence sequence_;
  TruthImages truth_;
  std::set<std::size_t> shown_;
};

/// One picture per frame, the checks side by side, and one of all: a row per check, as in the
/// paper.
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

nlohmann::ordered_json to_json(const std::vector<Check>& checks, bool has_truth) {
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
    json["checks"].push_back(one);
  }
  return json;
}

void print_table(const std::vector<Check>& checks, bool has_truth) {
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
}

Result<int> inspect(const InspectOptions& options) {
  SlamConfig config;
  Status settings = load_settings(options.run, config);
  if (!settings.ok()) return settings.error();
  auto sequence = open_sequence(options.run);
  if (!sequence.ok()) return sequence.error();
  const std::size_t from = options.run.from;
  const std::size_t to = options.run.to > 0 ? std::min(options.run.to, sequence->pairs.size())
                                            : sequence->pairs.size();
  if (from >= to) {
    return Error{ErrorKind::kUsage, "--from " + std::to_string(from) + " --to " +
                                        std::to_string(options.run.to) + ": no frame of the " +
                                        std::to_string(sequence->pairs.size())};
  }
  for (const std::size_t frame : options.frames) {
    if (frame >= from && frame < to) continue;
    return Error{ErrorKind::kUsage, "--frames " + std::to_string(frame) + ": not among the pairs " +
                                        std::to_string(from) + " to " + std::to_string(to - 1)};
  }
  if (!options.run.out_dir.empty()) {
    Status writable = ensure_writable_directory(options.run.out_dir);
    if (!writable.ok()) return writable.error();
  }
  Inspection inspection(options, std::move(sequence).value());
  std::vector<Check> checks;
  for (const std::string& name : options.checks) {
    checks.push_back(make_check(name, config));
    Status ran = inspection.run(checks.back());
    if (!ran.ok()) return ran.error();
    if (const int signal = StopSignal::received()) return 128 + signal;
  }
  const auto json = to_json(checks, inspection.has_truth());
  if (!options.run.out_dir.empty()) {
    const std::filesystem::path out = options.run.out_dir;
    Status written = write_pictures(out, checks);
    if (written.ok()) written = write_file_atomically(out / "inspect.json", json.dump(2) + "\n");
    if (!written.ok()) return written.error();
  }
  if (options.json) {
    std::printf("%s\n", json.dump(2).c_str());
  } else {
    print_table(checks, inspection.has_truth());
  }
  return 0;
}

}  // namespace

void add_inspect_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<InspectOptions>();
  CLI::App* command = app.add_subcommand(
      "inspect",
      "See which points are taken for moving: classic check, improved check, full system");
  add_input_options(*command, options->run);
  command->add_option("--out", options->run.out_dir, "Folder for pictures and inspect.json")
      ->type_name("DIR");
  command->add_option("--frames", options->frames, "Frames to draw, e.g. 44,68,216 (default: six)")
      ->delimiter(',')
      ->type_name("N,N,...");
  command->add_option("--checks", options->checks, "Which to run")
      ->delimiter(',')
      ->check(CLI::IsMember({"classic", "improved", "full"}))
      ->type_name("classic,improved,full")
      ->capture_default_str();
  command->add_option("--from", options->run.from, "First pair")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N");
  command->add_option("--to", options->run.to, "One past the last pair")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N");
  command->add_flag("--json", options->json, "Print JSON in place of the table");
  command->footer(
      "Examples:\n"
      "  ygslam inspect rgbd_dataset_freiburg3_walking_xyz --out fig5 --model yolov8n-seg.onnx "
      "--frames 44,68,216,499,663,759\n"
      "  ygslam inspect SEQ --checks full --segmenter masks:SEQ/mask --json\n"
      "classic: Harris corners, all vote for the fundamental matrix. improved: ORB points, only\n"
      "those that were static vote, depth as second opinion. full: masks as well.\n"
      "Where the truth is known, points with a white ring were missed, those with a black ring "
      "are\n"
      "false alarms.\n"
      "With mask/ (and moving/) beside the images it prints precision and recall of the dynamic\n"
      "points; unknown points count as static, points at mask edges and on movable things at rest\n"
      "are left out, as are the first 10 frames.");
  command->callback([options, &exit_code] {
    const StopSignal signal;
    const Result<int> code = inspect(*options);
    if (!code.ok()) log::error("{}", code.error().message);
    exit_code = code.ok() ? *code : static_cast<int>(code.error().kind);
  });
}

}  // namespace ygslam
