#include "motion/harris.hpp"

#include <opencv2/imgproc.hpp>

#include "motion/image_pyramid_levels.hpp"

namespace ygslam {

std::vector<Eigen::Vector2f> harris_corners(const ImagePyramid& image, int max_corners,
                                            double min_distance_px) {
  constexpr double kQuality = 0.01;
  constexpr int kBlockPx = 3;
  constexpr double kHarrisK = 0.04;
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(image.levels().mats[0], corners, max_corners, kQuality, min_distance_px,
                          cv::noArray(), kBlockPx, true, kHarrisK);
  std::vector<Eigen::Vector2f> points;
  points.reserve(corners.size());
  for (const cv::Point2f& c : corners) points.emplace_back(c.x, c.y);
  return points;
}

}  // namespace ygslam
