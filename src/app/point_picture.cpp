#include "app/point_picture.hpp"

#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "image/cv_view.hpp"
#include "io/atomic_file.hpp"
#include "io/image_file.hpp"
#include "segment/segmenter.hpp"

namespace ygslam {
namespace {

const cv::Scalar kGreen(60, 200, 60), kRed(235, 50, 50), kYellow(230, 200, 60),
    kBlue(40, 140, 240);  // r, g, b

void draw_object(cv::Mat& picture, const TrackedObject& object) {
  const PixelBox& box = object.box_px;
  const cv::Point corner(static_cast<int>(box.x0), static_cast<int>(box.y0));
  cv::rectangle(picture,
                cv::Rect(corner, cv::Point(static_cast<int>(box.x1), static_cast<int>(box.y1))),
                kBlue, object.resting ? 1 : 2, cv::LINE_AA);
  char text[64];
  std::snprintf(text, sizeof text, "%u %s %.1f m/s", index(object.id),
                coco_class_name(object.class_id).c_str(), object.velocity_world_mps.norm());
  const cv::Point at = corner + cv::Point(4, 15);
  cv::putText(picture, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.5, cv::Scalar(0, 0, 0), 3,
              cv::LINE_AA);
  cv::putText(picture, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.5, cv::Scalar(255, 255, 255), 1,
              cv::LINE_AA);
}

}  // namespace

cv::Mat picture_of(const RgbdFrame& frame) { return cv_view(frame.colour).clone(); }

void tint_masks(cv::Mat& picture, const GreyImage& ids) {
  if (ids.empty()) return;
  const cv::Vec3b tint(30, 90, 200);
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
  cv::drawContours(picture, contours, -1, cv::Scalar(40, 120, 220), 1, cv::LINE_AA);
}

void draw_points(cv::Mat& picture, const Features& features, const PointLabels& labels) {
  for (std::size_t i = 0; i < features.size(); ++i) {
    const cv::Point2f p(features.points[i].uv_px.x(), features.points[i].uv_px.y());
    const MotionLabel label = labels.label[i];
    const auto& colour = label == MotionLabel::kDynamic  ? kRed
                         : label == MotionLabel::kStatic ? kGreen
                                                         : kYellow;
    cv::circle(picture, p, 3, colour, 1, cv::LINE_AA);
  }
}

void draw_objects(cv::Mat& picture, std::span<const TrackedObject> objects) {
  for (const TrackedObject& object : objects)
    if (!object.box_px.empty()) draw_object(picture, object);
}

void draw_caption(cv::Mat& picture, const std::string& text) {
  const int bar = 20;
  picture.rowRange(picture.rows - bar, picture.rows) *= 0.35;
  cv::putText(picture, text, {6, picture.rows - 6}, cv::FONT_HERSHEY_SIMPLEX, 0.42,
              cv::Scalar(255, 255, 255), 1, cv::LINE_AA);
}

Status write_jpeg(const std::filesystem::path& file, const cv::Mat& picture) {
  ColourImage image(picture.cols, picture.rows);
  picture.copyTo(cv_view(image));
  return write_file_atomically(file, encode_jpeg(image, 88));
}

}  // namespace ygslam
