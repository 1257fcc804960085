#include "motion/flow/harris.hpp"

#include <opencv2/imgproc.hpp>

#include "motion/flow/image_pyramid_levels.hpp"

namespace ygslam {

std::vector<Eigen::Vector2f> harris_corners(const ImagePyramid& image, int max_corners,
                                            double min_distance_px) {
  constexpr double kQuality = 0.01;
  constexpr int kBlock_px = 3;
  constexpr double kHarrisK = 0.04;
  std::vector<cv::Point2f> corners;
  const PaddedImage& full = image.levels().level[0];
  // OpenCV has no const header; it only reads.
  const cv::Mat grey(full.height(), full.width(), CV_8UC1, const_cast<std::uint8_t*>(full.row(0)),
                     static_cast<std::size_t>(full.stride()));
  cv::goodFeaturesToTrack(grey, corners, max_corners, kQuality, min_distance_px, cv::noArray(),
                          kBlock_px, true, kHarrisK);
  std::vector<Eigen::Vector2f> points;
  points.reserve(corners.size());
  for (const cv::Point2f& c : corners) points.emplace_back(c.x, c.y);
  return points;
}

}  // namespace ygslam
