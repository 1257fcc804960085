#include "motion/lk_flow.hpp"

#include <cmath>
#include <limits>
#include <opencv2/video/tracking.hpp>

#include "motion/image_pyramid_levels.hpp"

namespace ygslam {
namespace {

/// Grey value between pixels; the caller keeps (x, y) inside by one pixel.
float interpolate(const cv::Mat& image, float x, float y) {
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  const float a = x - static_cast<float>(x0);
  const float b = y - static_cast<float>(y0);
  const std::uint8_t* top = image.ptr<std::uint8_t>(y0) + x0;
  const std::uint8_t* bottom = image.ptr<std::uint8_t>(y0 + 1) + x0;
  return (1 - b) * ((1 - a) * static_cast<float>(top[0]) + a * static_cast<float>(top[1])) +
         b * ((1 - a) * static_cast<float>(bottom[0]) + a * static_cast<float>(bottom[1]));
}

bool inside(const Eigen::Vector2f& p, const ImagePyramid::Levels& image, float margin_px) {
  return p.x() >= margin_px && p.y() >= margin_px &&
         p.x() <= static_cast<float>(image.width - 1) - margin_px &&
         p.y() <= static_cast<float>(image.height - 1) - margin_px;
}

/// Mean absolute difference of the 3x3 patches about two points [grey levels].
float patch_difference(const ImagePyramid::Levels& previous, const Eigen::Vector2f& from,
                       const ImagePyramid::Levels& current, const Eigen::Vector2f& to) {
  // The patch and its interpolation need two pixels on each side.
  if (!inside(from, previous, 2) || !inside(to, current, 2)) return 255.0F;
  float sum = 0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const auto x = static_cast<float>(dx);
      const auto y = static_cast<float>(dy);
      sum += std::abs(interpolate(previous.mats[0], from.x() + x, from.y() + y) -
                      interpolate(current.mats[0], to.x() + x, to.y() + y));
    }
  }
  return sum / 9.0F;
}

FlowPoint judge(const ImagePyramid::Levels& previous, const ImagePyramid::Levels& current,
                const Eigen::Vector2f& from, const Eigen::Vector2f& to, const FlowConfig& config) {
  FlowPoint point;
  point.end_uv_px = to;
  if (!to.allFinite() || !inside(to, current, 0)) return point;
  point.patch_diff = patch_difference(previous, from, current, to);
  if (!inside(to, current, static_cast<float>(config.border_px))) {
    point.status = FlowStatus::kBorder;
  } else {
    point.status = point.patch_diff > config.patch_diff ? FlowStatus::kPatch : FlowStatus::kFound;
  }
  return point;
}

}  // namespace

std::vector<FlowPoint> track_points(const ImagePyramid& previous, const ImagePyramid& current,
                                    std::span<const Eigen::Vector2f> points_uv_px,
                                    std::span<const Eigen::Vector2f> guesses_uv_px,
                                    const FlowConfig& config) {
  CHECK(!previous.empty() && !current.empty());
  CHECK(previous.width() == current.width() && previous.height() == current.height());
  CHECK(guesses_uv_px.empty() || guesses_uv_px.size() == points_uv_px.size());
  std::vector<FlowPoint> flow(points_uv_px.size());
  std::vector<cv::Point2f> from;
  std::vector<cv::Point2f> to;
  std::vector<std::size_t> source;
  for (std::size_t i = 0; i < points_uv_px.size(); ++i) {
    const Eigen::Vector2f& p = points_uv_px[i];
    if (!p.allFinite() || !inside(p, previous.levels(), 0)) continue;
    const bool guessed = !guesses_uv_px.empty() && guesses_uv_px[i].allFinite();
    const Eigen::Vector2f& guess = guessed ? guesses_uv_px[i] : p;
    from.emplace_back(p.x(), p.y());
    to.emplace_back(guess.x(), guess.y());
    source.push_back(i);
  }
  if (from.empty()) return flow;
  std::vector<std::uint8_t> status;
  const cv::TermCriteria stop(cv::TermCriteria::COUNT | cv::TermCriteria::EPS,
                              config.max_iterations, config.epsilon_px);
  cv::calcOpticalFlowPyrLK(previous.levels().mats, current.levels().mats, from, to, status,
                           cv::noArray(), {config.window_px, config.window_px}, config.levels, stop,
                           cv::OPTFLOW_USE_INITIAL_FLOW, config.min_eigenvalue);
  for (std::size_t k = 0; k < source.size(); ++k) {
    if (status[k] == 0) continue;
    flow[source[k]] = judge(previous.levels(), current.levels(), points_uv_px[source[k]],
                            {to[k].x, to[k].y}, config);
  }
  return flow;
}

std::vector<FlowEnd> flow_ends(std::span<const FlowPoint> flow) {
  std::vector<FlowEnd> ends(flow.size());
  for (std::size_t i = 0; i < flow.size(); ++i)
    ends[i] = {flow[i].end_uv_px, flow[i].status == FlowStatus::kFound};
  return ends;
}

}  // namespace ygslam
