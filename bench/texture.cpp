#include "texture.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "geometry/random_vector.hpp"
#include "image/cv_view.hpp"

namespace ygslam::bench {

Warp make_warp(const std::string& kind, int width, int height, Rng& rng) {
  Warp warp;
  double angle = rng.uniform(-0.1, 0.1);
  double scale = rng.uniform(0.97, 1.03);
  Eigen::Vector2d tilt(0, 0);
  warp.noise = 3;
  if (kind == "rotation") angle = rng.uniform(-std::numbers::pi, std::numbers::pi);
  if (kind == "scale") scale = std::exp(rng.uniform(std::log(0.6), std::log(1.6)));
  if (kind == "perspective") tilt = {rng.uniform(-6e-4, 6e-4), rng.uniform(-6e-4, 6e-4)};
  if (kind == "light") {
    warp.gain = rng.uniform(0.5, 1.3);
    warp.offset = rng.uniform(-20, 30);
  }
  if (kind == "noise") warp.noise = 8;
  Eigen::Matrix3d to_centre = Eigen::Matrix3d::Identity();
  to_centre.topRightCorner<2, 1>() = Eigen::Vector2d(-0.5 * width, -0.5 * height);
  Eigen::Matrix3d motion = Eigen::Matrix3d::Identity();
  motion.topLeftCorner<2, 2>() = scale * Eigen::Rotation2Dd(angle).toRotationMatrix();
  motion.topRightCorner<2, 1>() = random_in_box<2>(rng, {-25, -25}, {25, 25});
  motion.bottomLeftCorner<1, 2>() = tilt.transpose();
  warp.H = to_centre.inverse() * motion * to_centre;
  return warp;
}

GreyImage apply_warp(const GreyImage& image, const Warp& warp, Rng& rng) {
  cv::Mat H(3, 3, CV_64F);
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) H.at<double>(r, c) = warp.H(r, c);
  }
  GreyImage out(image.width(), image.height());
  cv::Mat view = cv_view(out);
  cv::warpPerspective(cv_view(image), view, H, view.size(), cv::INTER_CUBIC,
                      cv::BORDER_REFLECT_101);
  for (std::uint8_t& p : out) {
    const double value = warp.gain * p + warp.offset + rng.normal(0, warp.noise);
    p = static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
  }
  return out;
}

GreyImage render_texture(int width, int height, unsigned seed) {
  Rng rng(seed);
  cv::Mat canvas(height, width, CV_8UC1, cv::Scalar(rng.uniform(60, 180)));
  const auto point = [&] {
    const auto y = static_cast<int>(rng.uniform(-40, height + 40) * 16);
    return cv::Point(static_cast<int>(rng.uniform(-40, width + 40) * 16), y);
  };
  for (int i = 0; i < 400; ++i) {
    const double size = std::exp(rng.uniform(std::log(4.0), std::log(80.0))) * (i < 60 ? 2 : 1);
    const cv::Scalar grey(rng.uniform(10, 245));
    const cv::Point at = point();
    if (i % 3 == 0) {
      cv::circle(canvas, at, static_cast<int>(size * 8), grey, cv::FILLED, cv::LINE_AA, 4);
      continue;
    }
    std::vector<cv::Point> corners;
    const double start = rng.uniform(0, 6.28);
    const int sides = 3 + static_cast<int>(rng.below(3));
    for (int k = 0; k < sides; ++k) {
      const double angle = start + 6.2832 * k / sides + rng.uniform(-0.3, 0.3);
      corners.emplace_back(at.x + static_cast<int>(16 * size * std::cos(angle)),
                           at.y + static_cast<int>(16 * size * std::sin(angle)));
    }
    cv::fillConvexPoly(canvas, corners, grey, cv::LINE_AA, 4);
  }
  cv::Mat noise(height, width, CV_32F);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) noise.at<float>(v, u) = static_cast<float>(rng.normal(0, 25));
  }
  cv::GaussianBlur(noise, noise, {}, 1.5);
  cv::Mat mixed;
  cv::add(canvas, noise, mixed, cv::noArray(), CV_8U);
  cv::GaussianBlur(mixed, mixed, {}, 0.7);
  GreyImage image(width, height);
  mixed.copyTo(cv_view(image));
  return image;
}

}  // namespace ygslam::bench
