// Precision, recall and time of the motion checks on a recorded sequence with masks.
//   motion_bench [SEQUENCE]     default: redkitchen_walk of the shared data
// Before that the flow alone, beside OpenCV's.
// Truth: mask/ above 0; points within 3 px of a mask edge are left out; unknown counts as static.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "core/time.hpp"
#include "features/attach.hpp"
#include "features/orb.hpp"
#include "flow_table.hpp"
#include "image/cv_view.hpp"
#include "image/depth.hpp"
#include "motion/classification/point_classifier.hpp"

namespace ygslam {
namespace {

struct Recorded {
  FramePtr frame;
  SE3 T_world_camera;  // ground truth; identity without one
  FeaturesPtr features;
  SegmentationPtr masks;             // null where the sequence has none
  std::vector<std::int8_t> dynamic;  // per feature: 1, 0, or -1 = left out
};

CameraConfig read_camera(const std::string& folder) {
  CameraConfig c;
  std::ifstream in(folder + "/calibration.txt");
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string key;
    double value = 0;
    if (!(words >> key >> value)) continue;
    const std::pair<const char*, double*> fields[] = {
        {"fx", &c.fx}, {"fy", &c.fy},
        {"cx", &c.cx}, {"cy", &c.cy},
        {"k1", &c.k1}, {"k2", &c.k2},
        {"p1", &c.p1}, {"p2", &c.p2},
        {"k3", &c.k3}, {"depth_scale", &c.depth_scale}};
    for (const auto& [name, field] : fields)
      if (key == name) *field = value;
  }
  return c;
}

SegmentationPtr read_masks(const std::string& path, const RgbdFrame& frame) {
  const cv::Mat ids = std::ifstream(path) ? cv::imread(path, cv::IMREAD_GRAYSCALE) : cv::Mat();
  if (ids.empty()) return nullptr;
  auto masks = std::make_shared<Segmentation>();
  masks->frame = frame.id;
  masks->stamp = frame.stamp;
  masks->ids = GreyImage(ids.cols, ids.rows);
  ids.copyTo(cv_view(masks->ids));
  double largest = 0;
  cv::minMaxLoc(ids, nullptr, &largest);
  masks->instances.resize(static_cast<std::size_t>(largest));
  return masks;
}

std::vector<std::int8_t> truth(const Features& features, const GreyImage& ids) {
  cv::Mat person = cv_view(ids) > 0;
  const cv::Mat disc = cv::getStructuringElement(cv::MORPH_ELLIPSE, {7, 7});
  cv::Mat inner;
  cv::Mat outer;
  cv::erode(person, inner, disc);
  cv::dilate(person, outer, disc);
  std::vector<std::int8_t> labels;
  for (const Feature& f : features.points) {
    const cv::Point p(static_cast<int>(f.uv_px.x() + 0.5F), static_cast<int>(f.uv_px.y() + 0.5F));
    labels.push_back(inner.at<std::uint8_t>(p) != 0 ? 1 : outer.at<std::uint8_t>(p) != 0 ? -1 : 0);
  }
  return labels;
}

/// Stamp (as written) to pose.
std::map<std::string, SE3> read_poses(const std::string& path) {
  std::map<std::string, SE3> poses;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string stamp;
    Vec3 t;
    Eigen::Quaterniond q;
    if (words >> stamp >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w())
      poses[stamp] = SE3(q, t);
  }
  return poses;
}

std::vector<Recorded> read_sequence(const std::string& folder, const Camera& camera) {
  std::vector<Recorded> sequence;
  std::ifstream in(folder + "/associations.txt");
  OrbExtractor orb({});
  auto poses = read_poses(folder + "/groundtruth.txt");
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string stamp, rgb, depth_stamp, depth;
    if (!(words >> stamp >> rgb >> depth_stamp >> depth)) continue;
    const cv::Mat grey = cv::imread(folder + "/" + rgb, cv::IMREAD_GRAYSCALE);
    const cv::Mat raw = cv::imread(folder + "/" + depth, cv::IMREAD_UNCHANGED);
    if (grey.empty() || raw.empty() || raw.type() != CV_16U) continue;
    auto frame = std::make_shared<RgbdFrame>();
    frame->id = FrameId{static_cast<std::uint32_t>(sequence.size())};
    frame->grey = GreyImage(grey.cols, grey.rows);
    grey.copyTo(cv_view(frame->grey));
    Image<std::uint16_t> raw_depth(raw.cols, raw.rows);
    raw.copyTo(cv_view(raw_depth));
    frame->depth_m = depth_from_raw(raw_depth, camera.config().depth_scale, {});
    auto features = std::make_shared<Features>(orb.extract(frame->grey));
    attach_geometry(*features, camera, frame->depth_m, orb.scales());
    Recorded r{
        frame, poses[stamp], features, read_masks(folder + "/mask/" + stamp + ".png", *frame), {}};
    r.dynamic =
        r.masks ? truth(*features, r.masks->ids) : std::vector<std::int8_t>(features->size(), 0);
    sequence.push_back(std::move(r));
  }
  return sequence;
}

struct Variant {
  const char* name;
  DynamicConfig config;
  int mask_delay_frames = -1;  // -1 = no masks
};

std::vector<Variant> variants() {
  std::vector<Variant> list;
  DynamicConfig c;
  c.mode = DynamicMode::kGeometry;
  c.ego_motion.enabled = false;
  c.classifier.vote_of_neighbours = false;
  c.epipolar.prior = false;
  c.epipolar.corners = FlowCorners::kHarris;
  c.boundary.enabled = false;
  list.push_back({"classic: Harris, all vote", c});
  c.epipolar.corners = FlowCorners::kOrb;
  list.push_back({"classic on ORB points", c});
  c.epipolar.prior = true;
  list.push_back({"improved: prior (Algorithm 1)", c});
  c.ego_motion.enabled = true;
  c.boundary.enabled = true;
  c.classifier.vote_of_neighbours = true;
  list.push_back({"improved + neighbours + ego-motion", c});
  c.mode = DynamicMode::kSemantic;
  list.push_back({"masks, same frame", c, 0});
  list.push_back({"masks, 2 frames late", c, 2});
  list.push_back({"masks, 10 frames late", c, 10});
  c.mode = DynamicMode::kFull;
  list.push_back({"full, masks 2 frames late", c, 2});
  return list;
}

struct Tally {
  double true_positive = 0, flagged = 0, positive = 0, negative = 0;
};

void count(const Recorded& r, const PointLabels& labels, Tally& t) {
  for (std::size_t i = 0; i < r.dynamic.size(); ++i) {
    if (r.dynamic[i] < 0) continue;
    const bool flagged = labels.label[i] == MotionLabel::kDynamic;
    (r.dynamic[i] > 0 ? t.positive : t.negative) += 1;
    t.flagged += flagged ? 1 : 0;
    t.true_positive += flagged && r.dynamic[i] > 0 ? 1 : 0;
  }
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

void run_variant(const Variant& variant, const std::vector<Recorded>& sequence,
                 const Camera& camera) {
  PointClassifier classifier(variant.config, camera, 1);
  Tally tally;
  std::vector<double> ms;
  double believed = 0, checked = 0, linked = 0, points = 0, fallback_points = 0;
  for (std::size_t k = 0; k < sequence.size(); ++k) {
    std::vector<SegmentationPtr> masks;
    const auto delay = static_cast<std::size_t>(std::max(variant.mask_delay_frames, 0));
    if (variant.mask_delay_frames >= 0 && k >= delay) masks.push_back(sequence[k - delay].masks);
    const ScopedTimer timer;
    FrameEvidence evidence =
        classifier.observe(*sequence[k].frame, sequence[k].features, masks, std::nullopt);
    const PointLabels labels = classifier.classify(evidence);
    const bool done = evidence.epipolar.state == CheckState::kDone;
    const auto links = evidence.links;
    classifier.remember(std::move(evidence), labels.label);
    ms.push_back(timer.cpu_ms());
    if (k == 0) continue;
    count(sequence[k], labels, tally);
    fallback_points += labels.fallback_points;
    for (const auto link : links) linked += link >= 0 ? 1 : 0;
    points += static_cast<double>(sequence[k].features->size());
    if (!done) continue;
    checked += 1;
    believed += labels.check_believed ? 1 : 0;
  }
  std::printf("%-32s %7.3f %7.3f %9.4f | %6.2f %6.2f | %5.2f %8.2f %8.1f\n", variant.name,
              tally.flagged > 0 ? tally.true_positive / tally.flagged : 1.0,
              tally.positive > 0 ? tally.true_positive / tally.positive : 0.0,
              (tally.flagged - tally.true_positive) / std::max(tally.negative, 1.0),
              quantile(ms, 0.5), quantile(ms, 0.95), linked / std::max(points, 1.0),
              believed / std::max(checked, 1.0),
              fallback_points / static_cast<double>(sequence.size()));
}

void compare_flow(const std::vector<Recorded>& sequence, const Camera& camera) {
  bench::print_flow_accuracy();
  std::vector<bench::FlowPicture> pictures;
  for (const Recorded& r : sequence)
    pictures.push_back({&r.frame->grey, r.features.get(), r.T_world_camera});
  bench::print_flow_agreement(pictures, camera);
}

int main_bench(int argc, char** argv) {
  cv::setNumThreads(1);
  const char* shared = std::getenv("YGSLAM_SHARED");
  const std::string folder =
      argc > 1 ? argv[1] : std::string(shared ? shared : "../shared") + "/data/redkitchen_walk";
  const Camera camera(read_camera(folder));
  const auto sequence = read_sequence(folder, camera);
  if (sequence.empty()) {
    std::fprintf(stderr, "%s: no frames\n", folder.c_str());
    return 4;
  }
  compare_flow(sequence, camera);
  std::printf("\n%s: %zu frames\n%-32s %7s %7s %9s | %6s %6s | %5s %8s %8s\n", folder.c_str(),
              sequence.size(), "check", "precis.", "recall", "false al.", "ms med", "ms p95",
              "link", "believed", "fallback_points");
  for (const Variant& variant : variants()) run_variant(variant, sequence, camera);
  return 0;
}

}  // namespace
}  // namespace ygslam

int main(int argc, char** argv) { return ygslam::main_bench(argc, argv); }
