#include "segment/letterbox.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/rng.hpp"
#include "segment/planar.hpp"

namespace ygslam {
namespace {

ColourImage noise(int width, int height, Rng& rng) {
  ColourImage image(width, height);
  for (Rgb8& p : image) {
    p = {static_cast<std::uint8_t>(rng.below(256)), static_cast<std::uint8_t>(rng.below(256)),
         static_cast<std::uint8_t>(rng.below(256))};
  }
  return image;
}

int size_between(Rng& rng, int low, int high) {
  return low + static_cast<int>(rng.below(static_cast<std::uint32_t>(high - low)));
}

Letterbox random_letterbox(Rng& rng) {
  const int net_height = 32 * size_between(rng, 1, 40);
  const int net_width = 32 * size_between(rng, 1, 40);
  const int height = size_between(rng, 1, 2000);
  return make_letterbox(size_between(rng, 1, 2000), height, net_width, net_height);
}

TEST(Letterbox, WayBackIsExactForAnySizes) {
  Rng rng(1);
  for (int i = 0; i < 500; ++i) {
    const Letterbox box = random_letterbox(rng);
    const EdgePoint p{rng.uniform(0, box.image_width), rng.uniform(0, box.image_height)};
    const EdgePoint back = box.to_image(box.to_network(p));
    ASSERT_NEAR(back.x, p.x, 1e-9 * box.image_width);
    ASSERT_NEAR(back.y, p.y, 1e-9 * box.image_height);
  }
}

TEST(Letterbox, ImageFillsOneSideAndSitsInTheMiddle) {
  Rng rng(2);
  for (int i = 0; i < 500; ++i) {
    const Letterbox box = random_letterbox(rng);
    const int right = box.net_width - box.inner_width - box.pad_left;
    const int bottom = box.net_height - box.inner_height - box.pad_top;
    ASSERT_TRUE(box.inner_width == box.net_width || box.inner_height == box.net_height);
    ASSERT_TRUE(right - box.pad_left == 0 || right - box.pad_left == 1);
    ASSERT_TRUE(bottom - box.pad_top == 0 || bottom - box.pad_top == 1);
    // Same scale on both axes, up to the rounding of the inner size to whole pixels, at least one.
    const double scale = std::min(static_cast<double>(box.net_width) / box.image_width,
                                  static_cast<double>(box.net_height) / box.image_height);
    ASSERT_NEAR(std::max(1.0, box.image_width * scale), box.inner_width, 0.5 + 1e-9);
    ASSERT_NEAR(std::max(1.0, box.image_height * scale), box.inner_height, 0.5 + 1e-9);
  }
}

TEST(Letterbox, CornersOfTheImageMapToCornersOfItsPlace) {
  const Letterbox box = make_letterbox(641, 479, 512, 384);
  EXPECT_DOUBLE_EQ(box.to_network({0, 0}).x, box.pad_left);
  EXPECT_DOUBLE_EQ(box.to_network({0, 0}).y, box.pad_top);
  EXPECT_NEAR(box.to_network({641, 479}).x, box.pad_left + box.inner_width, 1e-9);
  EXPECT_NEAR(box.to_network({641, 479}).y, box.pad_top + box.inner_height, 1e-9);
}

TEST(Letterbox, ImageOfTheInputsSizeIsNotResampled) {
  Rng rng(3);
  const ColourImage image = noise(640, 480, rng);
  const Letterbox box = make_letterbox(640, 480, 640, 480);
  EXPECT_TRUE(box.identity());
  const ColourImage seen = letterboxed(image, box);
  EXPECT_TRUE(std::equal(image.begin(), image.end(), seen.begin()));
}

TEST(Letterbox, BorderIsGreyAndInsideKeepsTheColour) {
  const Letterbox box = make_letterbox(320, 180, 640, 480);
  const ColourImage seen = letterboxed(ColourImage(320, 180, {10, 20, 30}), box);
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const bool inside = v >= box.pad_top && v < box.pad_top + box.inner_height;
      const Rgb8 expected = inside ? Rgb8{10, 20, 30} : Rgb8{114, 114, 114};
      ASSERT_EQ(seen.at(u, v), expected) << u << " " << v;
    }
  }
}

TEST(Letterbox, PaintedPixelIsFoundWhereTheMappingSays) {
  // A bright block in the image must appear, after resampling, centred where to_network says.
  const Letterbox box = make_letterbox(1000, 500, 640, 480);
  ColourImage image(1000, 500);
  for (int v = 200; v < 240; ++v) {
    for (int u = 700; u < 760; ++u) image.at(u, v) = {255, 255, 255};
  }
  const ColourImage seen = letterboxed(image, box);
  double x = 0, y = 0, weight = 0;
  for (int v = box.pad_top; v < box.pad_top + box.inner_height; ++v) {
    for (int u = 0; u < 640; ++u) {
      x += (u + 0.5) * seen.at(u, v).r;
      y += (v + 0.5) * seen.at(u, v).r;
      weight += seen.at(u, v).r;
    }
  }
  const EdgePoint centre = box.to_network({730, 220});
  EXPECT_NEAR(x / weight, centre.x, 0.05);
  EXPECT_NEAR(y / weight, centre.y, 0.05);
}

TEST(Letterbox, TopLeftHasItsBorderOnOneSideAndStretchedHasNone) {
  const Letterbox top_left = make_letterbox(1280, 720, 640, 480, Placement::kTopLeft);
  EXPECT_EQ(top_left.inner_width, 640);
  EXPECT_EQ(top_left.inner_height, 360);
  EXPECT_EQ(top_left.pad_left, 0);
  EXPECT_EQ(top_left.pad_top, 0);
  EXPECT_DOUBLE_EQ(top_left.to_image({320, 180}).y, 360);

  const Letterbox stretched = make_letterbox(1280, 720, 312, 336, Placement::kStretched);
  EXPECT_EQ(stretched.inner_width, 312);
  EXPECT_EQ(stretched.inner_height, 336);
  const EdgePoint corner = stretched.to_network({1280, 720});
  EXPECT_DOUBLE_EQ(corner.x, 312);
  EXPECT_DOUBLE_EQ(corner.y, 336);
  Rng rng(6);
  const ColourImage image = noise(40, 30, rng);
  const Letterbox small = make_letterbox(40, 30, 60, 36, Placement::kTopLeft);
  const ColourImage seen = letterboxed(image, small);
  for (int v = 0; v < 36; ++v) {
    ASSERT_EQ(seen.at(48, v).r, kLetterboxGrey);
    ASSERT_EQ(seen.at(59, v).b, kLetterboxGrey);
  }
}

TEST(Planar, EveryByteArrivesInItsPlane) {
  Rng rng(4);
  const ColourImage image = noise(37, 11, rng);
  std::vector<float> planes(3 * image.size());
  to_planar(image, {}, planes.data());
  for (std::size_t i = 0; i < image.size(); ++i) {
    ASSERT_NEAR(planes[i], image.data()[i].r / 255.0, 1e-6);
    ASSERT_NEAR(planes[image.size() + i], image.data()[i].g / 255.0, 1e-6);
    ASSERT_NEAR(planes[2 * image.size() + i], image.data()[i].b / 255.0, 1e-6);
  }
}

TEST(Planar, MeanAndDeviationGoWithTheColourAndThePlanesCanBeInBlueGreenRed) {
  Rng rng(5);
  const ColourImage image = noise(13, 7, rng);
  const Normalisation form{{120, 110, 100}, {60, 55, 50}, ChannelOrder::kBgr};
  std::vector<float> planes(3 * image.size());
  to_planar(image, form, planes.data());
  for (std::size_t i = 0; i < image.size(); ++i) {
    ASSERT_NEAR(planes[i], (image.data()[i].b - 100) / 50.0, 1e-5);
    ASSERT_NEAR(planes[image.size() + i], (image.data()[i].g - 110) / 55.0, 1e-5);
    ASSERT_NEAR(planes[2 * image.size() + i], (image.data()[i].r - 120) / 60.0, 1e-5);
  }
}

}  // namespace
}  // namespace ygslam
