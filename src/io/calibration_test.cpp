#include "io/calibration.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

const std::string kGood = "fx 517.3\nfy 516.5\ncx 318.6\ncy 255.3\n";

// What a bad file is refused with; empty if it was taken.
std::string refusal(const std::string& text) {
  const auto camera = parse_calibration(text, "calibration.txt");
  if (camera.ok()) return {};
  EXPECT_EQ(camera.error().kind, ErrorKind::kConfig);
  EXPECT_EQ(camera.error().message.find('\n'), std::string::npos);
  return camera.error().message;
}

TEST(Calibration, ReadsAllKeysWithCommentsAndAnyLineEnds) {
  const auto camera = parse_calibration(
      "# TUM\r\n" + kGood + "k1 0.26 # radial\nk2 -0.95\np1 -0.005\np2 0.002\nk3 1.16\n" +
          "depth_scale 1000\nwidth 640\nheight 480\n",
      "calibration.txt");
  ASSERT_TRUE(camera.ok()) << camera.error().message;
  EXPECT_EQ(camera->fx, 517.3);
  EXPECT_EQ(camera->k3, 1.16);
  EXPECT_EQ(camera->depth_scale, 1000.0);
  EXPECT_EQ(camera->width, 640);
}

TEST(Calibration, SizeAndDistortionAreOptional) {
  const auto camera = parse_calibration(kGood, "calibration.txt");
  ASSERT_TRUE(camera.ok());
  EXPECT_EQ(camera->width, 0);
  EXPECT_EQ(camera->depth_scale, 5000.0);
  EXPECT_FALSE(camera->is_distorted());
}

TEST(Calibration, F20ImpossibleValuesAreRefusedNamingLineAndKey) {
  const auto with = [](const std::string& line) { return "# c\n" + line + "\n" + kGood; };
  for (const char* line :
       {"k1 1e9", "k1 nan", "k2 inf", "p1 5", "k3 -1e6", "depth_scale 0", "depth_scale -5000",
        "width 0", "width 1e9", "height 12.5", "height nan", "k1 abc", "k1", "k1 1 2"}) {
    const std::string key = std::string(line).substr(0, std::string(line).find(' '));
    const std::string message = refusal(with(line));
    EXPECT_NE(message.find("calibration.txt:2: " + key + ":"), std::string::npos)
        << line << " -> " << message;
  }
  for (const char* value : {"0", "-517.3", "nan", "inf", "1e12", "five"}) {
    const std::string message =
        refusal("fx " + std::string(value) + "\nfy 516.5\ncx 318.6\ncy 255.3\n");
    EXPECT_NE(message.find("calibration.txt:1: fx:"), std::string::npos) << message;
  }
}

TEST(Calibration, AFocalLengthBelowZeroIsACameraWithYUp) {
  const auto icl = parse_calibration("fx 481.2\nfy -480\ncx 319.5\ncy 239.5\n", "c");
  ASSERT_TRUE(icl.ok()) << icl.error().message;
  EXPECT_EQ(icl->fy, 480);
  EXPECT_EQ(icl->cy, 239.5) << "the same row lies on the axis";
  EXPECT_NE(refusal("fx 481\nfy -480\ncx 319\ncy 239\nk1 0.1\n").find(":2: fy:"), std::string::npos)
      << "distortion is not turned";
  EXPECT_NE(refusal("fx -481\nfy -480\ncx 319\ncy 239\n").find(":1: fx:"), std::string::npos);
}

TEST(Calibration, F20MissingTwiceGivenAndUnknownKeysAreNamed) {
  EXPECT_NE(refusal("fx 500\ncx 320\ncy 240\n").find("missing key 'fy'"), std::string::npos);
  EXPECT_NE(refusal(kGood + "fx 500\n").find(":5: fx: given twice"), std::string::npos);
  const std::string unknown = refusal(kGood + "depth_scal 5000\n");
  EXPECT_NE(unknown.find(":5: unknown key 'depth_scal', did you mean 'depth_scale'?"),
            std::string::npos)
      << unknown;
  EXPECT_FALSE(refusal("").empty());
  EXPECT_FALSE(refusal(kGood + ":\n").empty());
}

TEST(Calibration, F20ValuesThatDoNotFitTheImageSizeAreRefused) {
  CameraConfig camera;
  camera.fx = camera.fy = 525;
  camera.cx = 320;
  camera.cy = 240;
  EXPECT_TRUE(camera_faults(camera).empty());
  CameraConfig folded = camera;
  folded.k1 = -9;
  ASSERT_FALSE(camera_faults(folded).empty());
  EXPECT_EQ(camera_faults(folded).front().key, "k1");
  CameraConfig k3_forgotten = camera_preset("freiburg1")->camera;
  k3_forgotten.k3 = 0;
  ASSERT_FALSE(camera_faults(k3_forgotten).empty());
  EXPECT_EQ(camera_faults(k3_forgotten).front().key, "k1");
  EXPECT_NE(camera_faults(k3_forgotten).front().reason.find("k3 given?"), std::string::npos);
  CameraConfig at_the_edge = camera;
  at_the_edge.cx = 0;
  EXPECT_TRUE(camera_faults(at_the_edge).empty()) << "odd, but a camera";
  at_the_edge.cx = -1;
  EXPECT_EQ(camera_faults(at_the_edge).front().key, "cx");
  CameraConfig wide = camera;
  wide.fx = 5;
  EXPECT_EQ(camera_faults(wide).front().key, "fx");
  CameraConfig far_off = camera;
  far_off.cx = 5000;
  EXPECT_EQ(camera_faults(far_off).front().key, "cx");
  CameraConfig negative = camera;
  negative.width = -1;
  EXPECT_EQ(camera_faults(negative).front().key, "width");
}

TEST(Preset, KnownFoldersHavePlausibleCameras) {
  for (const char* name : {"rgbd_dataset_freiburg1_xyz", "rgbd_dataset_freiburg2_desk",
                           "rgbd_dataset_freiburg3_walking_xyz", "rgbd_bonn_balloon"}) {
    const auto preset = camera_preset(name);
    ASSERT_TRUE(preset.has_value()) << name;
    EXPECT_TRUE(camera_faults(preset->camera).empty()) << name;
    EXPECT_EQ(preset->camera.depth_scale, 5000.0);
  }
  EXPECT_EQ(camera_preset("rgbd_bonn_balloon")->camera.fx, 542.822841);
  EXPECT_TRUE(camera_preset("rgbd_dataset_freiburg1_xyz")->camera.is_distorted());
  EXPECT_FALSE(camera_preset("my_kitchen").has_value());
}

}  // namespace
}  // namespace ygslam
