#include "motion/flow/lk_flow.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <opencv2/video/tracking.hpp>

#include "core/rng.hpp"
#include "geometry/random_vector.hpp"
#include "image/cv_view.hpp"
#include "motion/motion_test_world.hpp"

namespace ygslam {
namespace {

using motion_test::texture;

/// A textured image shifted by (dx, dy), grey levels scaled and offset.
GreyImage shifted(double dx, double dy, double offset = 0) {
  GreyImage image(320, 240);
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < 320; ++u)
      image.at(u, v) = static_cast<std::uint8_t>(std::clamp(
          0.8 * texture((u - dx) / 2 + 300, (v - dy) / 2 + 300, 7) + offset, 0.0, 255.0));
  return image;
}

std::vector<Eigen::Vector2f> grid_points() {
  std::vector<Eigen::Vector2f> points;
  for (int v = 40; v <= 200; v += 10)
    for (int u = 40; u <= 280; u += 10) points.emplace_back(u + 0.3F, v + 0.6F);
  return points;
}

ImagePyramid pyramid(const GreyImage& image) {
  const FlowConfig config;
  return {image, config.levels, config.window_px};
}

/// Share of points whose flow was found within limit_px of the truth.
double share_right(const std::vector<FlowPoint>& flow, const std::vector<Eigen::Vector2f>& points,
                   const Eigen::Vector2f& shift, float limit_px) {
  double right = 0;
  for (std::size_t i = 0; i < flow.size(); ++i)
    right += flow[i].status == FlowStatus::kFound &&
                     (flow[i].end_uv_px - points[i] - shift).norm() < limit_px
                 ? 1
                 : 0;
  return right / static_cast<double>(flow.size());
}

TEST(LkFlow, FollowsShiftsToAFractionOfAPixel) {
  const auto points = grid_points();
  const ImagePyramid before = pyramid(shifted(0, 0));
  for (const Eigen::Vector2f& shift : {Eigen::Vector2f(0.4F, -0.7F), Eigen::Vector2f(5.25F, 3.5F),
                                       Eigen::Vector2f(-17.0F, 12.0F)}) {
    const ImagePyramid after = pyramid(shifted(shift.x(), shift.y()));
    const auto flow = track_points(before, after, points, {}, {});
    EXPECT_GT(share_right(flow, points, shift, 0.1F), 0.95) << shift.transpose();
  }
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values.at(static_cast<std::size_t>(q * static_cast<double>(values.size() - 1)));
}

/// Errors of OpenCV's flow with the same settings [px].
std::vector<double> referee_errors(const GreyImage& before, const GreyImage& after,
                                   const std::vector<Eigen::Vector2f>& points,
                                   const std::vector<Eigen::Vector2f>& truth) {
  const FlowConfig config;
  std::vector<cv::Point2f> from;
  for (const auto& p : points) from.emplace_back(p.x(), p.y());
  std::vector<cv::Point2f> to;
  std::vector<std::uint8_t> status;
  cv::calcOpticalFlowPyrLK(
      cv_view(before), cv_view(after), from, to, status, cv::noArray(),
      {config.window_px, config.window_px}, config.levels,
      {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, config.max_iterations, config.epsilon_px});
  std::vector<double> errors;
  for (std::size_t i = 0; i < to.size(); ++i)
    if (status[i] != 0) errors.push_back((Eigen::Vector2f(to[i].x, to[i].y) - truth[i]).norm());
  return errors;
}

TEST(LkFlow, IsAsPreciseAsTheReferee) {
  const auto points = grid_points();
  Rng rng(9);
  for (int trial = 0; trial < 4; ++trial) {
    const Eigen::Vector2f shift = random_in_box<2>(rng, {-6, -6}, {6, 6}).cast<float>();
    const double noise = trial % 2 == 0 ? 0 : 3;
    const auto noisy = [&](GreyImage image) {
      for (auto& p : image)
        p = static_cast<std::uint8_t>(std::clamp(p + rng.normal(0, noise) + 0.5, 0.0, 255.0));
      return image;
    };
    const GreyImage before = noisy(shifted(0, 0));
    const GreyImage after = noisy(shifted(shift.x(), shift.y()));
    std::vector<Eigen::Vector2f> truth = points;
    for (auto& p : truth) p += shift;
    const auto theirs = referee_errors(before, after, points, truth);
    std::vector<double> ours;
    const auto flow = track_points(pyramid(before), pyramid(after), points, {}, {});
    for (std::size_t i = 0; i < flow.size(); ++i)
      if (flow[i].status == FlowStatus::kFound)
        ours.push_back((flow[i].end_uv_px - truth[i]).norm());
    EXPECT_GE(ours.size() + 2, theirs.size());
    EXPECT_LT(quantile(ours, 0.5), 1.1 * quantile(theirs, 0.5) + 0.002);
    EXPECT_LT(quantile(ours, 0.95), 1.1 * quantile(theirs, 0.95) + 0.005);
  }
}

TEST(LkFlow, FindsAMoverThatNoGuessKnowsOf) {
  // The middle of the image moves against the rest.
  const Eigen::Vector2f shift(3, 1);
  const Eigen::Vector2f mover(-14, 9);
  const GreyImage before = shifted(0, 0);
  GreyImage after = shifted(shift.x(), shift.y());
  const GreyImage moved = shifted(mover.x(), mover.y());
  for (int v = 80; v < 170; ++v)
    for (int u = 100; u < 220; ++u) after.at(u, v) = moved.at(u, v);
  std::vector<Eigen::Vector2f> points;
  std::vector<Eigen::Vector2f> truth;
  for (const auto& p : grid_points()) {
    const Eigen::Vector2f q = p + mover;
    const bool on_mover = q.x() > 112 && q.x() < 207 && q.y() > 92 && q.y() < 157;
    const Eigen::Vector2f still = p + shift;
    const bool covered = still.x() > 86 && still.x() < 234 && still.y() > 66 && still.y() < 184;
    if (!on_mover && covered) continue;
    points.push_back(p);
    truth.push_back(on_mover ? q : still);
  }
  std::vector<Eigen::Vector2f> guesses;
  for (const auto& p : points) guesses.emplace_back(p + shift);
  const auto flow = track_points(pyramid(before), pyramid(after), points, guesses, {});
  double right = 0;
  for (std::size_t i = 0; i < flow.size(); ++i)
    right += flow[i].status == FlowStatus::kFound && (flow[i].end_uv_px - truth[i]).norm() < 0.2F;
  EXPECT_GT(right / static_cast<double>(flow.size()), 0.97);
}

TEST(LkFlow, GuessesReachMotionsTooLargeToFind) {
  const auto points = grid_points();
  const Eigen::Vector2f shift(75, -40);
  const ImagePyramid before = pyramid(shifted(0, 0));
  const ImagePyramid after = pyramid(shifted(shift.x(), shift.y()));
  std::vector<Eigen::Vector2f> guesses = points;
  for (auto& guess : guesses) guess += shift + Eigen::Vector2f(3, -4);
  const auto in_view = [&](const std::vector<FlowPoint>& flow) {
    double right = 0, all = 0;
    for (std::size_t i = 0; i < flow.size(); ++i) {
      const Eigen::Vector2f end = points[i] + shift;
      if (end.x() > 300 || end.y() < 20) continue;
      all += 1;
      right += flow[i].status == FlowStatus::kFound && (flow[i].end_uv_px - end).norm() < 0.2F;
    }
    return right / all;
  };
  EXPECT_LT(in_view(track_points(before, after, points, {}, {})), 0.3);
  EXPECT_GT(in_view(track_points(before, after, points, guesses, {})), 0.95);
}

TEST(LkFlow, EndsNearTheBorderAreDropped) {
  const FlowConfig config;
  const ImagePyramid before = pyramid(shifted(0, 0));
  const ImagePyramid after = pyramid(shifted(-6, 0));
  std::vector<Eigen::Vector2f> points;
  for (int v = 20; v < 220; v += 5) points.emplace_back(12.0F, static_cast<float>(v));
  for (const FlowPoint& p : track_points(before, after, points, {}, config)) {
    EXPECT_NE(p.status, FlowStatus::kFound);
  }
}

TEST(LkFlow, PointsThatGotCoveredAreDropped) {
  const GreyImage image = shifted(0, 0);
  GreyImage covered = image;
  for (int v = 60; v < 180; ++v)
    for (int u = 100; u < 220; ++u)
      covered.at(u, v) = static_cast<std::uint8_t>(texture(u + 900, v + 100, 99));
  std::vector<Eigen::Vector2f> points;
  for (int v = 80; v <= 160; v += 8)
    for (int u = 120; u <= 200; u += 8) points.emplace_back(u, v);
  FlowConfig strict;
  strict.patch_diff = 12;
  FlowConfig off = strict;
  off.patch_diff = 255;
  const auto found = [&](const FlowConfig& config) {
    int n = 0;
    for (const auto& p : track_points(pyramid(image), pyramid(covered), points, {}, config))
      n += p.status == FlowStatus::kFound ? 1 : 0;
    return n;
  };
  EXPECT_LT(found(strict), 0.5 * found(off));
  // Where nothing changed, the check costs nothing.
  const auto same = track_points(pyramid(image), pyramid(image), points, {}, strict);
  EXPECT_GT(share_right(same, points, {0, 0}, 0.05F), 0.99);
}

TEST(LkFlow, BlankImagesAndBadPointsAreLost) {
  const GreyImage blank(320, 240, 128);
  for (const FlowPoint& p : track_points(pyramid(blank), pyramid(blank), grid_points(), {}, {}))
    EXPECT_EQ(p.status, FlowStatus::kLost);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Eigen::Vector2f> bad{{nan, 3}, {-50, 20}, {1e9F, 1e9F}};
  const ImagePyramid image = pyramid(shifted(0, 0));
  for (const FlowPoint& p : track_points(image, image, bad, {}, {}))
    EXPECT_EQ(p.status, FlowStatus::kLost);
  const std::vector<Eigen::Vector2f> good{{100, 100}};
  const std::vector<Eigen::Vector2f> no_guess{{nan, nan}};
  EXPECT_EQ(track_points(image, image, good, no_guess, {})[0].status, FlowStatus::kFound);
  EXPECT_TRUE(track_points(image, image, {}, {}, {}).empty());
}

TEST(LkFlow, TinyImagesAreSafe) {
  GreyImage tiny(20, 16, 100);
  for (int u = 0; u < 20; ++u) tiny.at(u, u % 16) = 200;
  const std::vector<Eigen::Vector2f> points{{10, 8}, {0, 0}, {19, 15}};
  EXPECT_EQ(track_points(pyramid(tiny), pyramid(tiny), points, {}, {}).size(), 3U);
}

TEST(LkFlow, PointsAtTheSamePlaceFlowAlike) {
  auto points = grid_points();
  const std::size_t n = points.size();
  for (std::size_t i = 0; i < n; ++i)
    points.push_back(points[i] + Eigen::Vector2f(0.5F, i % 2 == 0 ? 0.5F : -0.5F));
  const Eigen::Vector2f shift(5.25F, 3.5F);
  const auto flow =
      track_points(pyramid(shifted(0, 0)), pyramid(shifted(5.25, 3.5)), points, {}, {});
  EXPECT_GT(share_right(flow, points, shift, 0.1F), 0.95);
}

}  // namespace
}  // namespace ygslam
