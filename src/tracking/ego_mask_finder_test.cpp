// What is fixed to the camera is found, and nothing else is.
#include "tracking/ego_mask_finder.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <functional>
#include <numbers>

#include "tracking/ego_mask_test_world.hpp"

namespace ygslam {
namespace {

using tracking_test::OverlaidRoom;

/// Where the image is in a frame, and what is laid over it.
using Motion = std::function<Eigen::Vector2d(int)>;
using Overlay = std::function<void(RgbdFrame&, int)>;

const Overlay kNothing = [](RgbdFrame&, int) {};

/// As a hand moves a camera: to and fro and up and down, 150 px a second on average.
Eigen::Vector2d by_hand(int frame) {
  const double t_s = frame * OverlaidRoom::kFrame_s;
  return {60 * std::sin(2.1 * t_s) + 40 * t_s, 45 * std::sin(1.3 * t_s + 0.5)};
}
Eigen::Vector2d stands(int /*frame*/) { return {3, 5}; }

struct Share {
  double of_covered = 0, of_rest = 0;
};

/// How much of what is covered is masked, and of the rest, but for a margin.
Share masked(const PixelMaskPtr& mask, const GreyImage& covered) {
  if (!mask) return {};
  constexpr int kMargin_px = 12;
  double hits = 0, all = 0, wrong = 0;
  for (int v = 0; v < covered.height(); ++v) {
    for (int u = 0; u < covered.width(); ++u) {
      if (covered.at(u, v) != 0) ++all;
      if (mask->at(u, v) == 0) continue;
      if (covered.at(u, v) != 0) ++hits;
      bool is_near = false;
      for (int y = std::max(0, v - kMargin_px); y <= std::min(covered.height() - 1, v + kMargin_px);
           y += 2)
        for (int x = std::max(0, u - kMargin_px);
             x <= std::min(covered.width() - 1, u + kMargin_px); x += 2)
          is_near |= covered.at(x, y) != 0;
      if (!is_near) ++wrong;
    }
  }
  return {all > 0 ? hits / all : 0, wrong / static_cast<double>(covered.size())};
}

class EgoMaskFinderTest : public ::testing::Test {
 protected:
  /// @return the mask after the last frame. The greatest share of all frames is kept.
  PixelMaskPtr see(int frames, const Motion& motion, const Overlay& overlay) {
    PixelMaskPtr mask;
    for (int i = 0; i < frames; ++i, ++number_) {
      const Eigen::Vector2d at_px = motion(number_);
      const auto frame = room_.see(number_, at_px.x(), at_px.y());
      overlay(*frame, number_);
      mask = finder_.step(*frame);
      most_ = std::max(most_, covered_share(mask));
    }
    return mask;
  }

  static constexpr int kSecond = 30;
  OverlaidRoom room_{3};
  EgoMaskFinder finder_{EgoMaskConfig{}};
  int number_ = 0;
  double most_ = 0;
};

TEST_F(EgoMaskFinderTest, TextIsFoundWithinASecondOfMotion) {
  GreyImage text;
  const auto mask =
      see(kSecond, by_hand, [&](RgbdFrame& f, int) { text = OverlaidRoom::write_text(f); });
  const Share share = masked(mask, text);
  EXPECT_GT(share.of_covered, 0.85);
  EXPECT_LT(share.of_rest, 0.001);
}

TEST_F(EgoMaskFinderTest, ABonnetIsFoundByItsPaintAndGrownByItsDepth) {
  GreyImage bonnet;
  const auto mask =
      see(2 * kSecond, by_hand, [&](RgbdFrame& f, int) { bonnet = OverlaidRoom::add_bonnet(f); });
  const Share share = masked(mask, bonnet);
  EXPECT_GT(share.of_covered, 0.95) << "half of it has no texture";
  EXPECT_LT(share.of_rest, 0.001);
  ASSERT_TRUE(mask);
  EXPECT_EQ(place_in_image(*mask), "lower edge");
}

TEST_F(EgoMaskFinderTest, DirtOnTheLensIsFound) {
  GreyImage dirt;
  const auto mask =
      see(2 * kSecond, by_hand, [&](RgbdFrame& f, int) { dirt = OverlaidRoom::add_dirt(f); });
  EXPECT_GT(masked(mask, dirt).of_covered, 0.8);
  EXPECT_LT(masked(mask, dirt).of_rest, 0.001);
}

TEST_F(EgoMaskFinderTest, AnImageOfTheRoomAloneHasNothingFixed) {
  see(10 * kSecond, by_hand, kNothing);
  EXPECT_LT(most_, 0.002);
}

TEST_F(EgoMaskFinderTest, ACameraThatStandsMakesNothingFixed) {
  see(2 * kSecond, stands, kNothing);
  see(2 * kSecond, stands, [](RgbdFrame& f, int) { OverlaidRoom::write_text(f); });
  EXPECT_EQ(most_, 0) << "nobody knows of the text before the camera moves";
}

TEST_F(EgoMaskFinderTest, WhoWalksBeforeAStandingCameraMakesNothingFixed) {
  // Of who fills more than half of the view, little at his edges, for a moment.
  for (const auto& [width_px, most] : {std::pair{150, 0.0}, {350, 0.015}, {500, 0.05}}) {
    see(3 * kSecond, stands, [&, width_px = width_px](RgbdFrame& f, int i) {
      OverlaidRoom::add_person(f, static_cast<int>(70 + 90 * std::sin(0.15 * i)), width_px);
    });
    EXPECT_LE(most_, most) << width_px;
  }
}

TEST_F(EgoMaskFinderTest, ASlowCameraMakesNothingFixed) {
  see(
      8 * kSecond, [](int i) { return Eigen::Vector2d(0.15 * i, 0.05 * i); }, kNothing);
  EXPECT_LT(most_, 0.002);
}

TEST_F(EgoMaskFinderTest, ACameraThatSwaysALittleMakesNothingFixed) {
  see(
      8 * kSecond,
      [](int i) { return Eigen::Vector2d(3 * std::sin(0.4 * i), 3 * std::cos(0.33 * i)); },
      kNothing);
  EXPECT_LT(most_, 0.01) << "edges about which it sways evenly";
}

TEST_F(EgoMaskFinderTest, EdgesAlongWhichTheCameraMovesAreOfTheWorld) {
  const auto shelves = [](RgbdFrame& f, int) {
    for (int v = 200; v < 290; ++v)
      for (int u = 0; u < f.grey.width(); ++u) f.grey.at(u, v) = v / 15 % 2 == 0 ? 40 : 200;
  };
  see(
      4 * kSecond, [](int i) { return Eigen::Vector2d(6.0 * i, 0); }, shelves);
  EXPECT_EQ(most_, 0);
}

TEST_F(EgoMaskFinderTest, StuckBlackAndFlickeringImagesMakeNothingFixed) {
  const auto dark = [](RgbdFrame& f, int) {
    std::fill(f.grey.begin(), f.grey.end(), std::uint8_t{0});
  };
  see(kSecond, by_hand, dark);
  const auto flicker = [](RgbdFrame& f, int i) {
    for (auto& grey : f.grey) grey = static_cast<std::uint8_t>(grey * (i % 2 == 0 ? 0.6 : 1.0));
  };
  see(3 * kSecond, stands, flicker);
  EXPECT_EQ(most_, 0);
}

TEST_F(EgoMaskFinderTest, WhatIsFixedNoLongerIsSeenAgain) {
  const auto text = [](RgbdFrame& f, int) { OverlaidRoom::write_text(f); };
  EXPECT_TRUE(see(2 * kSecond, by_hand, text));
  EXPECT_LT(covered_share(see(3 * kSecond, by_hand, kNothing)), 0.001);
}

TEST_F(EgoMaskFinderTest, AMaskStaysWhileTheCameraStands) {
  const auto text = [](RgbdFrame& f, int) { OverlaidRoom::write_text(f); };
  const auto before = see(kSecond, by_hand, text);
  const int stands_at = number_ - 1;
  EXPECT_EQ(see(
                2 * kSecond, [&](int) { return by_hand(stands_at); }, text),
            before)
      << "the same, not a copy";
}

TEST_F(EgoMaskFinderTest, AnotherImageSizeBeginsAnew) {
  EXPECT_TRUE(see(kSecond, by_hand, [](RgbdFrame& f, int) { OverlaidRoom::write_text(f); }));
  RgbdFrame small;
  small.stamp = {to_ns(1000)};
  small.grey = GreyImage(320, 240, 90);
  small.depth_m = DepthImage(320, 240, 1.0F);
  EXPECT_FALSE(finder_.step(small));
}

TEST_F(EgoMaskFinderTest, WithoutDepthTextIsFoundAllTheSame) {
  GreyImage text;
  const auto mask = see(kSecond, by_hand, [&](RgbdFrame& f, int) {
    text = OverlaidRoom::write_text(f);
    f.depth_m = DepthImage();
  });
  EXPECT_GT(masked(mask, text).of_covered, 0.85);
}

}  // namespace
}  // namespace ygslam
