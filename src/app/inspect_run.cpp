#include "app/inspect_run.hpp"

#include <algorithm>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <span>

#include "app/point_picture.hpp"
#include "app/program_log.hpp"
#include "app/progress_bar.hpp"
#include "app/stop_signal.hpp"
#include "eval/truth_boxes.hpp"
#include "segment/movable.hpp"
#include "segment/recorded_masks.hpp"

namespace ygslam {
namespace {

// While the system settles its labels do not count.
constexpr std::uint32_t kFirstScored = 10;
constexpr int kPictures = 6;
constexpr std::size_t kMasksLate = 32;

std::vector<JudgedPoint> judged_points(const TrackResult& result) {
  std::vector<JudgedPoint> points;
  for (std::size_t i = 0; i < result.features->size(); ++i) {
    points.push_back(
        {result.features->points[i].uv_px, result.labels.label[i] == MotionLabel::kDynamic});
  }
  return points;
}

std::vector<IdBox> tracked_boxes(const TrackResult& result) {
  std::vector<IdBox> boxes;
  for (const TrackedObject& object : result.objects)
    if (!object.box_px.empty())
      boxes.push_back({static_cast<int>(index(object.id)), object.box_px});
  return boxes;
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

}  // namespace

Check make_check(const std::string& name, const SlamConfig& base) {
  Check check{name, base, {}, {}, {}, {}};
  DynamicConfig& dynamic = check.config.dynamic;
  dynamic.mode = name == "full" ? DynamicMode::kFull : DynamicMode::kGeometry;
  if (name == "classic") {
    // Harris corners, all vote, the distance to the epipolar line alone decides.
    dynamic.epipolar.prior = false;
    dynamic.epipolar.corners = FlowCorners::kHarris;
    dynamic.ego_motion.enabled = false;
    dynamic.boundary.enabled = false;
    dynamic.classifier.vote_of_neighbours = false;
  }
  return check;
}

Inspection::Inspection(const InspectOptions& options, Sequence sequence)
    : options_(options), sequence_(std::move(sequence)), truth_(sequence_) {
  const std::size_t from = options_.run.from;
  const std::size_t to = std::min(options_.run.to > 0 ? options_.run.to : sequence_.pairs.size(),
                                  sequence_.pairs.size());
  for (const std::size_t frame : options_.frames) shown_.insert(frame);
  for (std::size_t k = 0; options_.frames.empty() && k < kPictures && from < to; ++k)
    shown_.insert(from + (2 * k + 1) * (to - from) / (2 * kPictures));
}

Result<SessionOptions> Inspection::session_options(const Check& check) const {
  SessionOptions session_options;
  Status segmenter = choose_segmenter(options_.run.segmenter, options_.run.model, session_options);
  if (!segmenter.ok()) return segmenter.error();
  session_options.without_model =
      "--segmenter none, --segmenter masks:DIR or --checks classic,improved";
  auto config = resolved(check.config);  // the mode is the check's own
  if (!config.ok()) return config.error();
  session_options.config = std::move(config).value();
  session_options.camera = sequence_.camera;
  session_options.config.run.shutter_source = sequence_.shutter_source;
  session_options.deterministic = !options_.live;
  session_options.may_wait = true;
  session_options.may_fork = true;
  return session_options;
}

Status Inspection::ready(const Check& check) const {
  if (!options_.run.model.empty()) return Ok{};  // to try it takes seconds
  const auto session = session_options(check);
  if (!session.ok()) return session.error();
  const auto segmenter = open_segmenter(*session);
  return segmenter.ok() ? Status(Ok{}) : Status(segmenter.error());
}

Status Inspection::run(Check& check) {
  auto opened = session_options(check);
  if (!opened.ok()) return opened.error();
  auto session = open_session(std::move(opened).value());
  if (!session.ok()) return session.error();
  const MovableClasses& movable = check.config.dynamic.masks.mask.movable;
  std::unique_ptr<Segmenter> true_masks;
  std::array<bool, 256> movable_id{};
  if (truth_.available()) {
    auto made = make_recorded_segmenter(sequence_.root / "mask");
    if (!made.ok()) return made.error();
    true_masks = std::move(made).value();
    const auto classes = read_recorded_classes(sequence_.root / "mask");
    if (!classes.ok()) return classes.error();
    for (std::size_t id = 0; id < movable_id.size(); ++id)
      movable_id[id] = movable.contains((*classes)[id]);
  }
  TruthBoxes truth_boxes(movable_id);
  std::map<FrameId, FramePtr> recent;
  FrameReaderConfig reading;
  reading.from = options_.run.from;
  if (options_.run.to > 0) reading.to = options_.run.to;
  reading.depth = check.config.depth;
  session->runner->add_sink(log_frame);
  FrameReader reader(sequence_, reading);
  ProgressBar progress(reader.length(), is_quiet());
  while (auto frame = reader.next()) {
    const TrackResult result = session->runner->process(*frame);
    std::optional<DynamicTruth> truth;
    check.objects.push_back({{}, tracked_boxes(result)});
    if (truth_.available()) {
      auto read = truth_.read((*frame)->stamp);
      if (!read.ok()) return read.error();
      truth = std::move(read).value();
      check.objects.back().truth = truth_boxes.step((*frame)->stamp, *truth);
      if (index((*frame)->id) >= kFirstScored)
        check.points += count_points(judged_points(result), *truth);
    }
    recent.emplace((*frame)->id, *frame);
    for (const SegmentationPtr& masks : result.masks) {
      if (!true_masks || !recent.contains(masks->frame)) continue;
      const auto wanted = true_masks->segment(*recent.at(masks->frame));
      if (!wanted.ok()) return wanted.error();
      check.mask += overlap(movable_mask(*masks, movable), movable_mask(*wanted, movable));
    }
    while (recent.size() > kMasksLate) recent.erase(recent.begin());
    draw(**frame, result, truth, check);
    progress.update(index((*frame)->id) + 1, check.name);
    if (StopSignal::received()) break;
  }
  static_cast<void>(session->runner->finish());
  return Ok{};
}

void Inspection::draw(const RgbdFrame& frame, const TrackResult& result,
                      const std::optional<DynamicTruth>& truth, Check& check) const {
  const std::size_t number = options_.run.from + index(frame.id);
  if (!shown_.contains(number)) return;
  cv::Mat picture = picture_of(frame);
  draw_points(picture, *result.features, result.labels);
  if (truth) ring_wrong_points(picture, judged_points(result), *truth);
  draw_objects(picture, result.objects);
  draw_caption(picture, check.name + "  frame " + std::to_string(number) + "  static " +
                            std::to_string(result.labels.static_points) + "  dynamic " +
                            std::to_string(result.labels.dynamic_points) + "  unknown " +
                            std::to_string(result.labels.unknown_points));
  check.pictures.emplace(static_cast<std::uint32_t>(number), std::move(picture));
}

}  // namespace ygslam
