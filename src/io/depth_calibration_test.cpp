#include "io/depth_calibration.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace ygslam {
namespace {

const std::string kLens = "fx 424.1\nfy 423.9\ncx 421.5\ncy 238.25\nwidth 848\nheight 480\n";
const std::string kPlace = "T_colour_depth 0.015 -0.001 0.0005 0 0.01 0 0.99995\n";

TEST(DepthCalibration, ReadsLensAndPlace) {
  const auto depth = parse_depth_calibration("# depth\n" + kPlace + kLens, "d.txt");
  ASSERT_TRUE(depth.ok()) << depth.error().message;
  EXPECT_EQ(depth->camera.width, 848);
  EXPECT_EQ(depth->camera.fx, 424.1);
  EXPECT_EQ(depth->camera.depth_scale, 0) << "that of the colour camera";
  EXPECT_EQ(depth->T_colour_depth.t(), Vec3(0.015, -0.001, 0.0005));
  EXPECT_NEAR(depth->T_colour_depth.angle(), 0.02, 1e-4);
}

TEST(DepthCalibration, ReadsBackWhatItWrites) {
  auto depth = *parse_depth_calibration(kLens + "k1 0.1\ndepth_scale 1000\n" + kPlace, "d.txt");
  const auto again = parse_depth_calibration(format_depth_calibration(depth), "again");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->camera.k1, 0.1);
  EXPECT_EQ(again->camera.depth_scale, 1000);
  EXPECT_TRUE(again->T_colour_depth.R().isApprox(depth.T_colour_depth.R(), 1e-9));
  EXPECT_TRUE(again->T_colour_depth.t().isApprox(depth.T_colour_depth.t(), 1e-9));
}

TEST(DepthCalibration, FilesOfOtherProgramsAreRead) {
  const std::string json = R"({"width": 848, "height": 480, "fx": 424.1, "fy": 423.9, "ppx": 421.5,
    "ppy": 238.25, "model": "Brown Conrady", "coeffs": [0, 0, 0, 0, 0])";
  const std::vector<std::string> files = {
      json + R"(, "T_colour_depth": [0.015, 0, 0, 0, 0, 0, 1]})",
      "Camera:\n  fx: 424.1\n  fy: 423.9\n  cx: 421.5\n  cy: 238.25\n  cols: 848\n  rows: 480\n"
      "T_colour_depth: [0.015, 0, 0, 0, 0, 0, 1]\n",
      std::string("424.1 423.9 421.5 238.25\nT_colour_depth 0.015 0 0 0 0 0 1\n")};
  for (const std::string& text : files) {
    const auto depth = parse_depth_calibration(text, "d.json");
    ASSERT_TRUE(depth.ok()) << depth.error().message;
    EXPECT_EQ(depth->camera.fx, 424.1);
    EXPECT_EQ(depth->camera.depth_scale, 0) << "that of the colour camera";
    EXPECT_EQ(depth->T_colour_depth.t(), Vec3(0.015, 0, 0));
    EXPECT_TRUE(parse_depth_calibration(format_depth_calibration(*depth), "again").ok());
  }
  const auto together = parse_depth_calibration(json + "}", "d.json");
  ASSERT_TRUE(together.ok()) << together.error().message;
  EXPECT_EQ(together->T_colour_depth.t(), Vec3(0, 0, 0)) << "warned of";
  EXPECT_FALSE(parse_depth_calibration(json + R"(, "T_colour_depth": [1, 2]})", "d.json").ok());
}

TEST(DepthCalibration, FaultsNameFileLineAndKey) {
  const auto message = [](const std::string& text) {
    const auto depth = parse_depth_calibration(text, "d.txt");
    return depth.ok() ? std::string("accepted") : depth.error().message;
  };
  EXPECT_EQ(message(kLens), "d.txt: missing key 'T_colour_depth'");
  EXPECT_EQ(message(kLens + "T_colour_depth 1 2 3\n"),
            "d.txt:7: T_colour_depth: needs tx ty tz qx qy qz qw");
  EXPECT_EQ(message(kLens + "T_colour_depth 0 0 x 0 0 0 1\n"),
            "d.txt:7: T_colour_depth: 'x' is not a finite number");
  EXPECT_EQ(message(kLens + "T_colour_depth 0 0 0 0 0 0 0.5\n"),
            "d.txt:7: T_colour_depth: the quaternion's length is not 1");
  EXPECT_EQ(message(kLens + "T_colour_depth 15 0 0 0 0 0 1\n"),
            "d.txt:7: T_colour_depth: the cameras are more than 2 m apart");
  EXPECT_EQ(message(kPlace + kPlace + kLens), "d.txt:2: T_colour_depth: given twice");
  EXPECT_EQ(message(kPlace + "fx 0\n"), "d.txt: missing key 'fy'");
  EXPECT_EQ(message(kPlace + kLens + "depth_delay_ms 3\n"),
            "d.txt:8: depth_delay_ms: belongs in calibration.txt");
  EXPECT_EQ(message(kPlace + "fz 1\n"), "d.txt:2: unknown key 'fz', did you mean 'fx'?");
}

}  // namespace
}  // namespace ygslam
