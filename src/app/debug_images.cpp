#include "app/debug_images.hpp"

#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "image/cv_view.hpp"
#include "io/atomic_file.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kWaitFrames = 12;
const cv::Scalar kGreen(60, 200, 60), kRed(50, 50, 235), kYellow(60, 200, 230);  // b, g, r

void tint_masks(cv::Mat& picture, const GreyImage& ids) {
  const cv::Vec3b tint(200, 90, 30);
  for (int v = 0; v < picture.rows; ++v) {
    for (int u = 0; u < picture.cols; ++u) {
      if (!ids.at(u, v)) continue;
      auto& pixel = picture.at<cv::Vec3b>(v, u);
      for (int c = 0; c < 3; ++c) pixel[c] = static_cast<std::uint8_t>((pixel[c] + tint[c]) / 2);
    }
  }
  cv::Mat inside = cv_view(ids) > 0;
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(inside, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  cv::drawContours(picture, contours, -1, cv::Scalar(220, 120, 40), 1, cv::LINE_AA);
}

void draw_points(cv::Mat& picture, const Features& features, const StaticLabels& labels) {
  for (std::size_t i = 0; i < features.size(); ++i) {
    const cv::Point2f p(features.points[i].uv_px.x(), features.points[i].uv_px.y());
    const MotionLabel label = labels.label[i];
    const auto& colour = label == MotionLabel::kDynamic  ? kRed
                         : label == MotionLabel::kStatic ? kGreen
                                                         : kYellow;
    cv::circle(picture, p, 3, colour, 1, cv::LINE_AA);
  }
}

void draw_caption(cv::Mat& picture, const std::string& text) {
  const int bar = 20;
  picture.rowRange(picture.rows - bar, picture.rows) *= 0.35;
  cv::putText(picture, text, {6, picture.rows - 6}, cv::FONT_HERSHEY_SIMPLEX, 0.42,
              cv::Scalar(255, 255, 255), 1, cv::LINE_AA);
}

}  // namespace

DebugImages::DebugImages(std::filesystem::path directory, int every)
    : directory_(std::move(directory)), every_(static_cast<std::uint32_t>(every)) {}

Status DebugImages::add(const FramePtr& frame, const TrackResult& result) {
  for (const SegmentationPtr& masks : result.masks) {
    for (Waiting& waiting : waiting_) {
      if (waiting.frame->id == masks->frame) waiting.masks = masks;
    }
  }
  if (index(frame->id) % every_ == 0) {
    waiting_.push_back({frame, result.features, result.labels, result.state, nullptr});
    for (const SegmentationPtr& masks : result.masks) {
      if (masks->frame == frame->id) waiting_.back().masks = masks;
    }
  }
  while (!waiting_.empty() &&
         (waiting_.front().masks ||
          index(frame->id) >= index(waiting_.front().frame->id) + kWaitFrames)) {
    Status written = write(waiting_.front());
    waiting_.pop_front();
    if (!written.ok()) return written;
  }
  return Ok{};
}

Status DebugImages::finish() {
  while (!waiting_.empty()) {
    Status written = write(waiting_.front());
    waiting_.pop_front();
    if (!written.ok()) return written;
  }
  return Ok{};
}

Status DebugImages::write(const Waiting& waiting) const {
  cv::Mat picture;
  cv::cvtColor(cv_view(waiting.frame->colour), picture, cv::COLOR_RGB2BGR);
  if (waiting.masks && !waiting.masks->ids.empty()) tint_masks(picture, waiting.masks->ids);
  draw_points(picture, *waiting.features, waiting.labels);
  const auto& labels = waiting.labels;
  draw_caption(picture, "frame " + std::to_string(index(waiting.frame->id)) + "  " +
                            to_string(waiting.state) + "  static " +
                            std::to_string(labels.static_points) + " (green)  dynamic " +
                            std::to_string(labels.dynamic_points) + " (red)  unknown " +
                            std::to_string(labels.unknown_points) + " (yellow)");
  char name[32];
  std::snprintf(name, sizeof name, "frame_%06u.jpg", index(waiting.frame->id));
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_QUALITY, 88});
  return write_file_atomically(directory_ / name,
                               {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace ygslam
