#include "features/orb.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "core/statistics.hpp"
#include "features/corner_strength.hpp"
#include "features/features_testing.hpp"
#include "features/matcher.hpp"

namespace ygslam {
namespace {

constexpr int kWidth = 480;
constexpr int kHeight = 360;

Features extract(const GreyImage& image, int count = 1000) {
  OrbConfig config;
  config.features = count;
  return OrbExtractor(config).extract(image);
}

TEST(Orb, NoneIsMadeWhereTheImageIsMaskedAndOthersTakeItsPlace) {
  const GreyImage image = testing::DiscWorld(31).view(kWidth, kHeight);
  GreyImage mask(kWidth, kHeight);
  for (int v = 0; v < kHeight; ++v) std::fill_n(mask.row(v), kWidth / 2, std::uint8_t{255});
  constexpr int kHalf_px = kWidth / 2;
  OrbConfig config;
  config.features = 400;
  const Features all = OrbExtractor(config).extract(image);
  const Features masked = OrbExtractor(config).extract(image, &mask);
  for (const Feature& feature : masked.points)
    EXPECT_GT(feature.uv_px.x(), kHalf_px + 1) << "octave " << int{feature.octave};
  const auto on_right = std::count_if(all.points.begin(), all.points.end(),
                                      [](const Feature& f) { return f.uv_px.x() > kHalf_px + 15; });
  EXPECT_GT(masked.size(), 1.3 * static_cast<double>(on_right));
}

struct Agreement {
  double repeated = 0;  // share of visible features with one within 2 px (scaled by the view)
  double correct = 0;   // share of matches within 3 px
  int matches = 0;
};

Agreement compare(const GreyImage& first, const GreyImage& second, double angle_rad, double scale) {
  const Features a = extract(first, 500);
  const Features b = extract(second, 500);
  const auto truth = [&](const Feature& f) {
    return testing::DiscWorld::moved(f.uv_px, kWidth, kHeight, angle_rad, scale);
  };
  int visible = 0;
  int repeated = 0;
  for (const Feature& f : a.points) {
    const Eigen::Vector2f expected = truth(f);
    if (expected.x() < 25 || expected.y() < 25 || expected.x() > kWidth - 26 ||
        expected.y() > kHeight - 26) {
      continue;
    }
    ++visible;
    repeated += std::any_of(b.points.begin(), b.points.end(),
                            [&](const Feature& g) { return (g.uv_px - expected).norm() < 2; });
  }
  Agreement result;
  for (const Match& m : match_brute_force(a, b)) {
    ++result.matches;
    result.correct += (b.points[m.b].uv_px - truth(a.points[m.a])).norm() < 3;
  }
  result.repeated = repeated / std::max(1.0, static_cast<double>(visible));
  result.correct /= std::max(1, result.matches);
  return result;
}

TEST(Orb, FindsTheSameCornersWhenTheViewTurns) {
  const testing::DiscWorld world(21);
  const GreyImage plain = world.view(kWidth, kHeight);
  for (const double angle_deg : {10.0, 45.0, 90.0, 137.0, 180.0, 300.0}) {
    const double angle_rad = angle_deg * std::numbers::pi / 180;
    const Agreement a = compare(plain, world.view(kWidth, kHeight, angle_rad), angle_rad, 1);
    EXPECT_GT(a.repeated, 0.75) << angle_deg;
    EXPECT_GT(a.correct, 0.93) << angle_deg;
    EXPECT_GT(a.matches, 120) << angle_deg;
  }
}

TEST(Orb, FindsTheSameCornersWhenTheViewGrowsOrShrinks) {
  const testing::DiscWorld world(22);
  const GreyImage plain = world.view(kWidth, kHeight);
  for (const double scale : {0.6, 0.8, 1.25, 1.7}) {
    const Agreement a = compare(plain, world.view(kWidth, kHeight, 0, scale), 0, scale);
    EXPECT_GT(a.repeated, 0.55) << scale;
    EXPECT_GT(a.correct, 0.9) << scale;
    EXPECT_GT(a.matches, 60) << scale;
  }
}

TEST(Orb, FindsTheSameCornersInOtherLight) {
  const testing::DiscWorld world(23);
  const GreyImage plain = world.view(kWidth, kHeight);
  for (const auto& [gain, offset] : {std::pair{0.5, 0.0}, {0.7, 60.0}, {0.9, -10.0}}) {
    const Agreement a = compare(plain, world.view(kWidth, kHeight, 0, 1, gain, offset), 0, 1);
    EXPECT_GT(a.repeated, 0.9) << gain;
    EXPECT_GT(a.correct, 0.97) << gain;
    EXPECT_GT(a.matches, 300) << gain;
  }
}

TEST(Orb, OrientationTurnsWithTheView) {
  const testing::DiscWorld world(24);
  const double angle_rad = 1.0;
  const Features a = extract(world.view(kWidth, kHeight));
  const Features b = extract(world.view(kWidth, kHeight, angle_rad));
  std::vector<double> errors;
  for (const Match& m : match_brute_force(a, b)) {
    const double change = b.points[m.b].angle_rad - a.points[m.a].angle_rad - angle_rad;
    errors.push_back(std::abs(std::remainder(change, 2 * std::numbers::pi)));
  }
  ASSERT_GT(errors.size(), 100U);
  EXPECT_LT(median(errors), 0.05);
}

// The mean over all matches would reveal an offset of a level's pixels against the image's.
TEST(Orb, PositionsOfAllOctavesAreUnbiasedAndSharperThanAPixel) {
  const testing::DiscWorld world(25);
  const Features a = extract(world.view(kWidth, kHeight));
  const double angle_rad = std::numbers::pi / 2;
  const Features b = extract(world.view(kWidth, kHeight, angle_rad));
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  std::vector<double> fine;
  int count = 0;
  for (const Match& m : match_brute_force(a, b)) {
    const Eigen::Vector2f error_px =
        b.points[m.b].uv_px -
        testing::DiscWorld::moved(a.points[m.a].uv_px, kWidth, kHeight, angle_rad, 1);
    if (error_px.norm() > 4) continue;
    if (a.points[m.a].octave == 0) fine.push_back(error_px.norm());
    sum += error_px.cast<double>();
    ++count;
  }
  ASSERT_GT(count, 100);
  ASSERT_GT(fine.size(), 20U);
  EXPECT_LT((sum / count).norm(), 0.1);
  EXPECT_LT(median(fine), 0.35);
}

TEST(Orb, SameImageSameFeaturesWhateverCameBefore) {
  const GreyImage image = testing::DiscWorld(26).view(kWidth, kHeight);
  OrbExtractor used{OrbConfig{}};
  (void)used.extract(testing::noise_image(640, 480, 1));
  (void)used.extract(GreyImage(50, 50, 9));
  const Features a = used.extract(image);
  const Features b = OrbExtractor(OrbConfig{}).extract(image);
  ASSERT_EQ(a.size(), b.size());
  ASSERT_GT(a.size(), 300U);
  EXPECT_EQ(a.descriptors, b.descriptors);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a.points[i].uv_px, b.points[i].uv_px);
    EXPECT_EQ(a.points[i].angle_rad, b.points[i].angle_rad);
    EXPECT_EQ(a.points[i].response, b.points[i].response);
    EXPECT_EQ(a.points[i].octave, b.points[i].octave);
  }
}

TEST(Orb, FieldsAreInTheirRanges) {
  OrbConfig config;
  config.features = 700;
  const Features f = OrbExtractor(config).extract(testing::noise_image(kWidth, kHeight, 4));
  EXPECT_EQ(f.size(), 700U);
  EXPECT_EQ(f.descriptors.size(), f.points.size());
  std::set<int> octaves;
  for (const Feature& p : f.points) {
    EXPECT_GE(p.angle_rad, 0);
    EXPECT_LT(p.angle_rad, 2 * std::numbers::pi_v<float>);
    EXPECT_GT(p.response, 0);
    EXPECT_EQ(p.depth_m, 0);
    EXPECT_EQ(p.ideal_px, p.uv_px);
    const double margin_px = 15 * PyramidScales(config.levels, config.scale_factor).of(p.octave);
    EXPECT_GE(p.uv_px.minCoeff(), margin_px);
    EXPECT_LE(p.uv_px.x(), kWidth - 1 - margin_px);
    EXPECT_LE(p.uv_px.y(), kHeight - 1 - margin_px);
    octaves.insert(p.octave);
  }
  EXPECT_EQ(octaves.size(), 8U);
}

TEST(Orb, EvennessSpreadsTheFeatures) {
  // Strong contrast in the left third, weak elsewhere.
  GreyImage image = testing::DiscWorld(27).view(kWidth, kHeight);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = kWidth / 3; u < kWidth; ++u) {
      image.at(u, v) = static_cast<std::uint8_t>(128 + (image.at(u, v) - 128) / 2);
    }
  }
  const auto cells = [&](double evenness) {
    OrbConfig config;
    config.features = 150;
    config.evenness = evenness;
    std::set<std::pair<int, int>> occupied;
    for (const Feature& f : OrbExtractor(config).extract(image).points) {
      occupied.emplace(static_cast<int>(f.uv_px.x()) / 40, static_cast<int>(f.uv_px.y()) / 40);
    }
    return occupied.size();
  };
  EXPECT_GT(cells(0.5), cells(0.0));
  EXPECT_GT(cells(2.0), cells(0.0) * 3 / 2);
}

TEST(Orb, TinyAndUniformImagesGiveNothing) {
  OrbExtractor extractor{OrbConfig{}};
  EXPECT_EQ(extractor.extract(GreyImage()).size(), 0U);
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 400}, {400, 1}, {8, 8}, {33, 33}}) {
    EXPECT_EQ(extractor.extract(testing::noise_image(width, height, 1)).size(), 0U);
  }
  for (int side = 34; side < 60; ++side) {
    (void)extractor.extract(testing::noise_image(side, 34, 1));
    (void)extractor.extract(testing::noise_image(34, side, 1));
  }
  for (const int grey : {0, 128, 255}) {
    EXPECT_EQ(extractor.extract(GreyImage(640, 480, static_cast<std::uint8_t>(grey))).size(), 0U);
  }
}

TEST(Orb, GivesAtMostWhatWasAsked) {
  const GreyImage image = testing::noise_image(kWidth, kHeight, 6);
  for (const int count : {0, 1, 7, 50, 999}) {
    EXPECT_EQ(static_cast<int>(extract(image, count).size()), count);
  }
}

TEST(CornerStrength, IsLargeAtCornersAndNoneOnEdgesAndPlains) {
  GreyImage image(64, 64, 40);
  for (int v = 32; v < 64; ++v) {
    for (int u = 32; u < 64; ++u) image.at(u, v) = 200;
  }
  PaddedImage padded;
  padded.assign(image, kLevelBorder_px);
  const auto at = [&](int u, int v) { return harris_strength(padded.row(v) + u, padded.stride()); };
  EXPECT_GT(at(32, 32), 1e6F);
  EXPECT_EQ(at(32, 50), 0);
  EXPECT_EQ(at(50, 32), 0);
  EXPECT_EQ(at(10, 10), 0);
}

}  // namespace
}  // namespace ygslam
