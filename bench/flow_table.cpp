#include "flow_table.hpp"

#include <algorithm>
#include <cstdio>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <string>

#include "core/rng.hpp"
#include "core/time.hpp"
#include "features/orb.hpp"
#include "image/cv_view.hpp"
#include "motion/flow/lk_flow.hpp"
#include "texture.hpp"

namespace ygslam::bench {
namespace {

using Points = std::vector<Eigen::Vector2f>;

// The checks that both flows share are off: what is compared is the search itself.
FlowConfig bare_flow() {
  FlowConfig config;
  config.patch_diff = 255;
  return config;
}

/// Keeps the last frame's pyramid, as a run does.
class OurFlow {
 public:
  std::vector<FlowPoint> next(const GreyImage& image, const Points& points, const Points& guesses) {
    const FlowConfig config = bare_flow();
    ImagePyramid current(image, config.levels, config.window_px);
    std::vector<FlowPoint> flow;
    if (!last_.empty()) flow = track_points(last_, current, points, guesses, config);
    last_ = std::move(current);
    return flow;
  }

 private:
  ImagePyramid last_;
};

/// OpenCV's with the same window, levels, iterations and limits.
class OpencvFlow {
 public:
  std::vector<FlowPoint> next(const GreyImage& image, const Points& points, const Points& guesses) {
    const FlowConfig config = bare_flow();
    const cv::Size window(config.window_px, config.window_px);
    std::vector<cv::Mat> current;
    cv::buildOpticalFlowPyramid(cv_view(image), current, window, config.levels, true,
                                cv::BORDER_REFLECT_101, cv::BORDER_CONSTANT, false);
    std::vector<FlowPoint> flow;
    if (!last_.empty() && !points.empty()) {
      std::vector<cv::Point2f> from;
      std::vector<cv::Point2f> to;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const Eigen::Vector2f& guess = guesses.empty() ? points[i] : guesses[i];
        from.emplace_back(points[i].x(), points[i].y());
        to.emplace_back(guess.x(), guess.y());
      }
      std::vector<std::uint8_t> status;
      const cv::TermCriteria stop(cv::TermCriteria::COUNT | cv::TermCriteria::EPS,
                                  config.max_iterations, config.epsilon_px);
      cv::calcOpticalFlowPyrLK(last_, current, from, to, status, cv::noArray(), window,
                               config.levels, stop, cv::OPTFLOW_USE_INITIAL_FLOW,
                               config.min_eigenvalue);
      const auto border = static_cast<float>(config.border_px);
      for (std::size_t i = 0; i < to.size(); ++i) {
        const bool inside = to[i].x >= border && to[i].y >= border &&
                            to[i].x <= static_cast<float>(image.width() - 1) - border &&
                            to[i].y <= static_cast<float>(image.height() - 1) - border;
        const bool found = status[i] != 0 && inside;
        flow.push_back({{to[i].x, to[i].y}, found ? FlowStatus::kFound : FlowStatus::kLost, 0.0F});
      }
    }
    last_ = std::move(current);
    return flow;
  }

 private:
  std::vector<cv::Mat> last_;
};

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

double share_within(const std::vector<double>& values, double limit) {
  const auto n = std::count_if(values.begin(), values.end(), [&](double v) { return v <= limit; });
  return static_cast<double>(n) / std::max<double>(static_cast<double>(values.size()), 1);
}

Points positions(const Features& features) {
  Points points;
  for (const Feature& f : features.points) points.push_back(f.uv_px);
  return points;
}

struct Motion {
  const char* name;
  double shift_px, angle_deg, zoom, perspective, gain, noise;
};

/// First pixel to second pixel, about the middle of the image.
Eigen::Matrix3d homography(const Motion& motion, cv::Size size, Rng& rng) {
  const double a = motion.angle_deg * std::numbers::pi / 180;
  const double direction = rng.uniform(0, 2 * std::numbers::pi);
  Eigen::Matrix3d centre = Eigen::Matrix3d::Identity();
  centre.topRightCorner<2, 1>() = Eigen::Vector2d(size.width, size.height) / 2;
  Eigen::Matrix3d inner = Eigen::Matrix3d::Identity();
  inner.topLeftCorner<2, 2>() = motion.zoom * Eigen::Rotation2Dd(a).toRotationMatrix();
  inner.topRightCorner<2, 1>() =
      motion.shift_px * Eigen::Vector2d(std::cos(direction), std::sin(direction));
  inner.bottomLeftCorner<1, 2>() << motion.perspective, -motion.perspective;
  return centre * inner * centre.inverse();
}

/// The texture at half its size as a camera behind the homography sees it.
GreyImage view(const GreyImage& texture, const Eigen::Matrix3d& H, const Motion& motion, Rng& rng) {
  Eigen::Matrix3d half = Eigen::Matrix3d::Identity();
  half.diagonal() << 0.5, 0.5, 1;
  const Eigen::Matrix3d M = H * half;
  const cv::Matx33d matrix(M(0, 0), M(0, 1), M(0, 2), M(1, 0), M(1, 1), M(1, 2), M(2, 0), M(2, 1),
                           M(2, 2));
  cv::Mat smooth;
  cv_view(texture).convertTo(smooth, CV_32F);
  cv::GaussianBlur(smooth, smooth, {}, 1.0);
  cv::Mat seen;
  cv::warpPerspective(smooth, seen, matrix, {texture.width() / 2, texture.height() / 2},
                      cv::INTER_CUBIC, cv::BORDER_REFLECT_101);
  GreyImage image(seen.cols, seen.rows);
  for (int v = 0; v < seen.rows; ++v)
    for (int u = 0; u < seen.cols; ++u)
      image.at(u, v) = static_cast<std::uint8_t>(std::clamp(
          motion.gain * seen.at<float>(v, u) + rng.normal(0, motion.noise) + 0.5, 0.0, 255.0));
  return image;
}

struct Errors {
  std::vector<double> px;  // of the points found
  double visible = 0;

  void add(const std::vector<FlowPoint>& flow, const Points& truth, const std::vector<bool>& seen) {
    for (std::size_t i = 0; i < flow.size(); ++i) {
      if (!seen[i]) continue;
      visible += 1;
      if (flow[i].status == FlowStatus::kFound) px.push_back((flow[i].end_uv_px - truth[i]).norm());
    }
  }
  void print(const char* motion, const char* name) const {
    std::printf("%-28s %-7s %7.3f %8.3f %8.3f %8.3f %8.3f\n", motion, name,
                static_cast<double>(px.size()) / std::max(visible, 1.0), quantile(px, 0.5),
                quantile(px, 0.95), share_within(px, 0.1), share_within(px, 1.0));
  }
};

void compare_on(const Motion& motion) {
  Errors ours;
  Errors opencv;
  OrbExtractor orb({});
  Rng rng(7);
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const GreyImage texture = render_texture(1280, 960, seed);
    const Eigen::Matrix3d H = homography(motion, {640, 480}, rng);
    Motion still = motion;
    still.gain = 1;
    const GreyImage before = view(texture, Eigen::Matrix3d::Identity(), still, rng);
    const GreyImage after = view(texture, H, motion, rng);
    const Points points = positions(orb.extract(before));
    Points truth;
    std::vector<bool> seen;
    for (const auto& p : points) {
      const Eigen::Vector2d q = (H * p.cast<double>().homogeneous()).hnormalized();
      truth.push_back(q.cast<float>());
      seen.push_back(q.x() > 16 && q.y() > 16 && q.x() < 640 - 17 && q.y() < 480 - 17);
    }
    OurFlow our_flow;
    OpencvFlow opencv_flow;
    (void)our_flow.next(before, {}, {});
    (void)opencv_flow.next(before, {}, {});
    ours.add(our_flow.next(after, points, {}), truth, seen);
    opencv.add(opencv_flow.next(after, points, {}), truth, seen);
  }
  ours.print(motion.name, "ours");
  opencv.print("", "opencv");
}

/// Where fixed points should appear if the camera goes on as between the two frames before.
Points guess_ends(const FlowPicture& older, const FlowPicture& last, const Camera& camera) {
  if (!older.T_world_camera || !last.T_world_camera) return positions(*last.features);
  const SE3 T_current_last = last.T_world_camera->inverse() * *older.T_world_camera;
  Points ends;
  for (const Feature& f : last.features->points) {
    const double depth_m = f.depth_m > 0 ? f.depth_m : 2.0;
    const Vec3 p = T_current_last * camera.unproject(f.ideal_px.cast<double>(), depth_m);
    ends.push_back(p.z() > 0.05 ? Eigen::Vector2f(camera.distort(camera.project(p)).cast<float>())
                                : f.uv_px);
  }
  return ends;
}

struct Agreement {
  std::vector<double> our_ms, opencv_ms, distance_px;
  double points = 0, ours = 0, opencv = 0;

  void add(const std::vector<FlowPoint>& a, const std::vector<FlowPoint>& b) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      const bool in_a = a[i].status == FlowStatus::kFound;
      const bool in_b = b[i].status == FlowStatus::kFound;
      points += 1;
      ours += in_a ? 1 : 0;
      opencv += in_b ? 1 : 0;
      if (in_a && in_b) distance_px.push_back((a[i].end_uv_px - b[i].end_uv_px).norm());
    }
  }
  void print(const char* name) const {
    std::printf("%-28s %7.3f %7.3f | %7.3f %7.3f %7.3f %7.3f | %7.3f %7.3f\n", name, ours / points,
                opencv / points, quantile(distance_px, 0.5), share_within(distance_px, 0.1),
                share_within(distance_px, 0.5), share_within(distance_px, 2.0),
                quantile(our_ms, 0.5), quantile(opencv_ms, 0.5));
  }
};

void compare_along(const std::vector<FlowPicture>& sequence, const Camera& camera, bool guessed) {
  OurFlow our_flow;
  OpencvFlow opencv_flow;
  Agreement agreement;
  for (std::size_t k = 0; k < sequence.size(); ++k) {
    const Points points = k > 0 ? positions(*sequence[k - 1].features) : Points{};
    const Points guesses =
        k > 1 && guessed ? guess_ends(sequence[k - 2], sequence[k - 1], camera) : Points{};
    const ScopedTimer our_timer;
    const auto a = our_flow.next(*sequence[k].grey, points, guesses);
    agreement.our_ms.push_back(our_timer.cpu_ms());
    const ScopedTimer opencv_timer;
    const auto b = opencv_flow.next(*sequence[k].grey, points, guesses);
    agreement.opencv_ms.push_back(opencv_timer.cpu_ms());
    if (k > 1) agreement.add(a, b);
  }
  agreement.print(guessed ? "guess: constant velocity" : "no guess");
}

}  // namespace

void print_flow_accuracy() {
  const Motion motions[] = {{"shift 2 px", 2, 0, 1, 0, 1, 0},
                            {"shift 12 px", 12, 0, 1, 0, 1, 0},
                            {"shift 25 px", 25, 0, 1, 0, 1, 0},
                            {"turn 2 deg, shift 3 px", 3, 2, 1, 0, 1, 0},
                            {"zoom 3 %, perspective", 2, 0, 1.03, 5e-5, 1, 0},
                            {"noise 4, gain 1.04, 6 px", 6, 0.5, 1.01, 0, 1.04, 4}};
  std::printf("\nflow against exact truth         found   median     95 %%  <0.1 px    <1 px\n");
  for (const Motion& motion : motions) compare_on(motion);
}

void print_flow_agreement(const std::vector<FlowPicture>& sequence, const Camera& camera) {
  std::printf(
      "\nflow on recorded frames          found  opencv | apart: median, share within 0.1, "
      "0.5, 2 px | cpu ms, opencv\n");
  compare_along(sequence, camera, false);
  compare_along(sequence, camera, true);
}

}  // namespace ygslam::bench
