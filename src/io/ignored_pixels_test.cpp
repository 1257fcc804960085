#include "io/ignored_pixels.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "core/rng.hpp"
#include "io/calibration.hpp"
#include "io/image_file.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

const std::string kPlainLens = "fx 500\nfy 500\ncx 320\ncy 240\n";

GreyImage painted(const std::vector<PixelRectangle>& rectangles, int width, int height) {
  GreyImage image(width, height);
  for (const PixelRectangle& r : rectangles)
    for (int v = r.v; v < r.v + r.height; ++v)
      for (int u = r.u; u < r.u + r.width; ++u) image.at(u, v) = 255;
  return image;
}

void write(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

TEST(IgnoredPixels, RectanglesCoverJustWhatAMaskCovers) {
  Rng rng(1);
  for (int round = 0; round < 20; ++round) {
    GreyImage mask(40, 30);
    for (auto& pixel : mask) pixel = rng.below(3) == 0 ? 255 : 0;
    EXPECT_TRUE(std::ranges::equal(painted(rectangles_of(mask), 40, 30), mask));
  }
  EXPECT_EQ(rectangles_of(painted({{3, 4, 20, 10}}, 40, 30)),
            (std::vector<PixelRectangle>{{3, 4, 20, 10}}));
  EXPECT_TRUE(rectangles_of(GreyImage(40, 30)).empty());
}

TEST(IgnoredPixels, ACameraFileNamesRectanglesAndIsWrittenWithThem) {
  const auto camera = parse_calibration(
      kPlainLens + "width 640\nheight 480\nignore 0 420 640 60 10 10 200 30 # bonnet, clock\n",
      "c");
  ASSERT_TRUE(camera.ok()) << camera.error().message;
  EXPECT_EQ(camera->ignored, (std::vector<PixelRectangle>{{0, 420, 640, 60}, {10, 10, 200, 30}}));
  const auto again = parse_calibration(format_calibration(*camera), "c");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->ignored, camera->ignored);
}

TEST(IgnoredPixels, AnImageCountsFromTheFileAndItsSizeIsTheCameras) {
  const testing::TempFolder folder;
  const GreyImage mask = painted({{0, 420, 640, 60}, {100, 7, 3, 3}}, 640, 480);
  write(folder.path() / "bonnet.png", encode_png(mask));
  write(folder.path() / "calibration.txt", kPlainLens + "ignore bonnet.png\n");
  const auto camera = read_calibration(folder.path() / "calibration.txt");
  ASSERT_TRUE(camera.ok()) << camera.error().message;
  EXPECT_TRUE(std::ranges::equal(painted(camera->ignored, 640, 480), mask));
  EXPECT_EQ(camera->width, 640);
}

TEST(IgnoredPixels, WhatIsWrongIsToldInOneLine) {
  const testing::TempFolder folder;
  write(folder.path() / "small.png", encode_png(GreyImage(320, 240, 255)));
  const auto refusal = [&](const std::string& value) {
    const auto camera = parse_calibration(
        "ignore " + value + "\nwidth 640\nheight 480\n" + kPlainLens, "camera.txt", folder.path());
    std::string message = camera.ok() ? "" : camera.error().message;
    EXPECT_TRUE(message.starts_with("camera.txt:1: ignore: ")) << value << " -> " << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
    return message;
  };
  EXPECT_NE(refusal("0 420 641 60").find("must lie in the image of 640x480"), std::string::npos);
  EXPECT_NE(refusal("0 -1 20 20").find("must lie in the image"), std::string::npos);
  EXPECT_NE(refusal("0 0 0 20").find("must lie in the image"), std::string::npos);
  EXPECT_NE(refusal("0 420 640").find("four numbers"), std::string::npos);
  EXPECT_NE(refusal("0 420 640 h").find("'h'"), std::string::npos);
  EXPECT_NE(refusal("0 420 640 2.5").find("'2.5'"), std::string::npos);
  EXPECT_NE(refusal("small.png").find("640x480"), std::string::npos);
  EXPECT_NE(refusal("none.png").find("none.png"), std::string::npos);
  EXPECT_FALSE(parse_calibration(kPlainLens + "ignore small.png\n", "c").ok()) << "of no file";
}

}  // namespace
}  // namespace ygslam
