#include "io/camera_formats.hpp"

#include <gtest/gtest.h>

#include "io/calibration.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

ForeignCamera foreign_of(const std::string& text) {
  const auto found = parse_foreign_camera(text, "camera");
  EXPECT_TRUE(found && found->ok()) << text;
  return found && found->ok() ? **found : ForeignCamera{};
}

void expect_lens(const CameraConfig& camera, double k1, double depth_scale) {
  EXPECT_EQ(camera.fx, 517.3);
  EXPECT_EQ(camera.fy, 516.5);
  EXPECT_EQ(camera.cx, 318.6);
  EXPECT_EQ(camera.cy, 255.3);
  EXPECT_EQ(camera.k1, k1);
  EXPECT_EQ(camera.depth_scale, depth_scale);
}

TEST(CameraFormats, SettingsOfOrbSlam) {
  for (const std::string prefix : {"Camera.", "Camera1."}) {
    std::string text = "%YAML:1.0\n---\n# comment\nCamera.type: \"PinHole\"\n";
    for (const char* line :
         {"fx: 517.3", "fy: 516.5", "cx: 318.6", "cy: 255.3", "k1: 0.26 # radial", "k2: -0.95",
          "p1: -0.005", "p2: 0.002", "k3: 1.16"})
      text += prefix + line + "\n";
    text += "Camera.width: 640\nCamera.height: 480\nCamera.fps: 30.0\nCamera.RGB: 1\n";
    const auto two = foreign_of(text + "DepthMapFactor: 1000.0\nORBextractor.nFeatures: 1000\n");
    expect_lens(two.camera, 0.26, 1000);
    EXPECT_EQ(two.camera.k3, 1.16);
    EXPECT_EQ(two.camera.width, 640);
    EXPECT_EQ(two.taken_for, "settings of ORB-SLAM or stella_vslam");
    expect_lens(foreign_of(text + "RGBD.DepthMapFactor: 5208.0\n").camera, 0.26, 5208);
  }
}

TEST(CameraFormats, SettingsOfStella) {
  const auto found = foreign_of(
      "Camera.model: \"perspective\"\nCamera.fx: 517.3\nCamera.fy: 516.5\nCamera.cx: 318.6\n"
      "Camera.cy: 255.3\nCamera.cols: 640\nCamera.rows: 480\ndepthmap_factor: 5000.0\n");
  expect_lens(found.camera, 0, 5000);
  EXPECT_EQ(found.camera.height, 480);
}

TEST(CameraFormats, SettingsOfStellaBelowTheirGroups) {
  const auto found = foreign_of(
      "# comment\nCamera:\n  name: \"TUM RGB-D\"\n  setup: \"RGBD\"\n  model: \"perspective\"\n"
      "  fx: 517.3\n  fy: 516.5\n  cx: 318.6\n  cy: 255.3\n  cols: 640\n  rows: 480\n"
      "Preprocessing:\n  depthmap_factor: 1000.0\n");
  expect_lens(found.camera, 0, 1000);
  EXPECT_EQ(found.camera.width, 640);
  EXPECT_TRUE(found.says_depth_scale);
  const auto fisheye = parse_foreign_camera(
      "Camera:\n  model: \"fisheye\"\n  fx: 1\n  fy: 1\n  cx: 1\n  cy: 1\n", "camera");
  ASSERT_TRUE(fisheye.has_value());
  EXPECT_FALSE(fisheye->ok());
}

TEST(CameraFormats, InfoOfBundleFusion) {
  const auto found = foreign_of(
      "m_colorWidth = 640\nm_colorHeight = 480\nm_depthShift = 1000\n"
      "m_calibrationColorIntrinsic = 517.3 0 318.6 0 0 516.5 255.3 0 0 0 1 0 0 0 0 1\n");
  expect_lens(found.camera, 0, 1000);
  EXPECT_EQ(found.taken_for, "info.txt of BundleFusion");
}

TEST(CameraFormats, CameraInfoOfRos) {
  const auto found = foreign_of(
      "image_width: 640\nimage_height: 480\ncamera_name: rgb\ncamera_matrix:\n  rows: 3\n  cols: "
      "3\n"
      "  data: [517.3, 0.0, 318.6, 0.0, 516.5,\n         255.3, 0.0, 0.0, 1.0]\n"
      "distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n"
      "  data: [0.26, -0.95, -0.005, 0.002, 1.16]\nrectification_matrix:\n  rows: 3\n  cols: 3\n"
      "  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n");
  expect_lens(found.camera, 0.26, 1000);
  EXPECT_EQ(found.camera.p2, 0.002);
  EXPECT_EQ(found.camera.width, 640);
  const auto echoed = foreign_of(
      "height: 480\nwidth: 640\ndistortion_model: \"plumb_bob\"\nD: [0.26, 0.0, 0.0, 0.0, 0.0]\n"
      "K: [517.3, 0.0, 318.6, 0.0, 516.5, 255.3, 0.0, 0.0, 1.0]\n");
  expect_lens(echoed.camera, 0.26, 1000);
}

TEST(CameraFormats, NumbersAlone) {
  expect_lens(foreign_of("517.3 516.5 318.6 255.3\n").camera, 0, 0);
  expect_lens(
      foreign_of("# fx fy cx cy\n517.3, 516.5, 318.6, 255.3, 0.26, -0.95, 0, 0, 1.16\n").camera,
      0.26, 0);
  expect_lens(foreign_of("517.3 0 318.6\n0 516.5 255.3\n0 0 1\n").camera, 0, 0);
  expect_lens(foreign_of("517.3 0 318.6 0\n0 516.5 255.3 0\n0 0 1 0\n0 0 0 1\n").camera, 0, 0);
}

TEST(CameraFormats, JsonOfOpen3dRealSenseAndNerfstudio) {
  const auto open3d = foreign_of(
      R"({"width": 640, "height": 480, "intrinsic_matrix": [517.3, 0, 0, 0, 516.5, 0, 318.6, 255.3, 1]})");
  expect_lens(open3d.camera, 0, 1000);
  EXPECT_EQ(open3d.camera.width, 640);
  expect_lens(foreign_of(R"({"width": 640, "height": 480, "fx": 517.3, "fy": 516.5, "ppx": 318.6,
                             "ppy": 255.3, "model": "distortion.brown_conrady",
                             "coeffs": [0.26, -0.95, 0, 0, 1.16]})")
                  .camera,
              0.26, 1000);
  const auto nerf = foreign_of(
      R"({"camera_model": "OPENCV", "fl_x": 517.3, "fl_y": 516.5, "cx": 318.6, "cy": 255.3, "w": 640,
          "h": 480, "k1": 0.26, "k2": -0.95, "p1": 0, "p2": 0, "frames": []})");
  expect_lens(nerf.camera, 0.26, 1000);
  EXPECT_EQ(nerf.camera.height, 480);
}

TEST(CameraFormats, EchoOfRos2HasAListWithOneNumberALine) {
  const std::string text =
      "header:\n  stamp:\n    sec: 5\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob\n"
      "d:\n- 0.26\n- 0.0\n- 0.0\n- 0.0\n- 0.0\nk:\n- 517.3\n- 0.0\n- 318.6\n- 0.0\n- 516.5\n"
      "- 255.3\n- 0.0\n- 0.0\n- 1.0\nr: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nbinning_x: 0\nroi:\n"
      "  x_offset: 0\n---\n";
  expect_lens(foreign_of(text).camera, 0.26, 1000);
  expect_lens(foreign_of(text + text).camera, 0.26, 1000);
}

TEST(CameraFormats, CalibratorsOfOthers) {
  const std::string lens =
      "camera_model: pinhole\n  distortion_model: radtan\n  intrinsics: [517.3, 516.5, 318.6, "
      "255.3]\n  resolution: [640, 480]\n";
  const auto kalibr = foreign_of("cam0:\n  distortion_coeffs: [0.26, 0, 0, 0]\n  " + lens);
  expect_lens(kalibr.camera, 0.26, 1000);
  EXPECT_EQ(kalibr.camera.height, 480);
  expect_lens(foreign_of("sensor_type: camera\nT_BS:\n  data: [1, 0]\nresolution: [640, 480]\n"
                         "camera_model: pinhole\nintrinsics: [517.3, 516.5, 318.6, 255.3] # fu\n"
                         "distortion_model: radial-tangential\n"
                         "distortion_coefficients: [0.26, 0, 0, 0]\n")
                  .camera,
              0.26, 1000);
  expect_lens(
      foreign_of("%YAML:1.0\n---\nmodel_type: PINHOLE\nimage_width: 640\nimage_height: 480\n"
                 "distortion_parameters:\n   k1: 0.26\n   k2: 0\n   p1: 0\n   p2: 0\n"
                 "projection_parameters:\n   fx: 517.3\n   fy: 516.5\n   cx: 318.6\n   cy: 255.3\n")
          .camera,
      0.26, 1000);
}

TEST(CameraFormats, SettingsOfNeuralMappers) {
  const std::string lens = "  fx: 517.3\n  fy: 516.5\n  cx: 318.6\n  cy: 255.3\n";
  const auto nice = foreign_of("dataset: tum\ncam:\n  H: 480\n  W: 640\n" + lens +
                               "  png_depth_scale: 5000.0 # in png format\n  crop_edge: 8\n"
                               "  distortion: [0.26, -0.95, 0, 0, 1.16]\n");
  expect_lens(nice.camera, 0.26, 5000);
  EXPECT_EQ(nice.camera.k3, 1.16);
  EXPECT_EQ(nice.camera.height, 480);
  const auto splatam = foreign_of("camera_params:\n  image_height: 480\n  image_width: 640\n" +
                                  lens + "  png_depth_scale: 6553.5\n");
  expect_lens(splatam.camera, 0, 6553.5);
  EXPECT_EQ(splatam.camera.width, 640);
}

TEST(CameraFormats, CamerasOfColmap) {
  for (const auto& [line, k1] : {std::pair{"PINHOLE 640 480 517.3 516.5 319.1 255.8", 0.0},
                                 {"OPENCV 640 480 517.3 516.5 319.1 255.8 0.26 0 0 0", 0.26}}) {
    const auto found = foreign_of("# Camera list\n1 " + std::string(line) + "\n");
    EXPECT_NEAR(found.camera.cx, 318.6, 1e-9);  // from the middle of the first pixel
    EXPECT_NEAR(found.camera.cy, 255.3, 1e-9);
    EXPECT_EQ(found.camera.fy, 516.5);
    EXPECT_EQ(found.camera.k1, k1);
    EXPECT_EQ(found.camera.width, 640);
  }
  const auto radial = foreign_of("1 RADIAL 640 480 517.3 319.1 255.8 0.26 -0.9\n");
  EXPECT_EQ(radial.camera.fy, 517.3);
  EXPECT_EQ(radial.camera.k2, -0.9);
}

TEST(CameraFormats, UnitsOfDepthInJson) {
  for (const auto& [key, scale] : {std::pair{R"("depth_scale": 4000.0)", 4000.0},
                                   {R"("depth_scale": 0.00025)", 4000.0},
                                   {R"("depth_unit_scale_factor": 0.001)", 1000.0}}) {
    const auto found =
        foreign_of(R"({"intrinsic_matrix": [517.3, 0, 0, 0, 516.5, 0, 318.6, 255.3, 1], )" +
                   std::string(key) + "}");
    EXPECT_NEAR(found.camera.depth_scale, scale, 1e-9);
    EXPECT_TRUE(found.says_depth_scale);
  }
}

TEST(CameraFormats, WhatIsNotReadIsRefusedByName) {
  const std::string orb = "Camera.fx: 517.3\nCamera.fy: 516.5\nCamera.cx: 318.6\n";
  const std::string K = "camera_matrix:\n data: [517, 0, 318, 0, 516, 255, 0, 0, 1]\n";
  for (const auto& [text, part] : std::vector<std::pair<std::string, std::string>>{
           {orb, "missing key 'Camera.cy'"},
           {orb + "Camera.cy: nan\n", "Camera.cy: 'nan' is not a finite number"},
           {orb + "Camera.cy: 255\nCamera.type: \"KannalaBrandt8\"\n",
            "'KannalaBrandt8' is not read"},
           {orb + "Camera.cy: 255\nCamera.width: -3\n", "Camera.width: is no size"},
           {K + "distortion_model: equidistant\n", "'equidistant' is not read"},
           {"camera_matrix:\n data: [1, 2]\n", "is no 3x3 or 4x4 matrix"},
           {"525.0 525.0 319.5 239.5 640 480\n", "6 numbers without keys: write `fx fy cx cy`"},
           {"525.0\n", "1 numbers without keys"},
           {orb + "Camera.cy: 255\nCamera.fx: 535.4\n", "Camera.fx: given twice"},
           {orb + "Camera.cy: 255\nCamera.k4: 0.1\n", "Camera.k4: is not read"},
           {orb + "Camera1.fx: 400\n", "both Camera.fx and Camera1.fx"},
           {K + "binning_x: 2\n", "binned image, which is not read"},
           {K + "roi:\n  x_offset: 100\n", "cut image, which is not read"},
           {K + "fisheye_model: 1\n", "fisheye_model: is not read"},
           {"K: [517, 0, 318, 0, 516, 255, 0, 0, 1]\nxi: 1.2\n", "xi: an omnidirectional"},
           {K + "camera_matrix: [500, 0, 318, 0, 516, 255, 0, 0, 1]\n", "no numbers, or two kinds"},
           {"cam0:\n  camera_model: omni\n  intrinsics: [1, 5, 5, 3, 2]\n", "'omni' is not read"},
           {"cam0:\n  intrinsics: [5, 5, 3, 2]\ncam1:\n  intrinsics: [5, 5, 3, 2]\n",
            "several cameras"},
           {"model_type: MEI\n", "'MEI' is not read"},
           {"1 OPENCV_FISHEYE 640 480 5 5 3 2 0 0 0 0\n", "'OPENCV_FISHEYE' is not read"},
           {"1 PINHOLE 640 480 5 5 3 2\n2 PINHOLE 640 480 6 6 3 2\n", "several cameras"},
           {"cam:\n  fx: 5\n  png_depth_scale: 1000\n", ": is missing, or no finite number"},
           {"%YAML:1.0\nK1: 5\n", "YAML of OpenCV without a camera"},
           {"<?xml version=\"1.0\"?>\n<opencv_storage>\n", "is XML"},
           {R"({"fl_x": 5, "fl_y": 5, "cx": 3, "cy": 2, "is_fisheye": true})", "is_fisheye"},
           {R"({"fl_x": 5, "fl_y": 5, "cx": 3, "cy": 2, "k4": 0.1})", "k4: is not read"},
           {R"({"fl_x": 5, "fl_y": 5, "cx": 3, "cy": 2, "frames": [{"fl_x": 7}]})",
            "lenses of their own"},
           {R"({"fx": 5, "fy": 5, "ppx": 3, "ppy": 2, "coeffs": [0.1, 0, 0.01, 0, 0],
                "model": "distortion.modified_brown_conrady"})",
            "is not read: only Brown-Conrady"},
           {R"({"camera_model": "OPENCV_FISHEYE", "fl_x": 5, "fl_y": 5, "cx": 3, "cy": 2})",
            "'OPENCV_FISHEYE' is not read"},
           {R"({"frames": []})", "JSON without a camera"},
           {R"({"fl_x": 525.0, "fl_y": NaN})", "begins as JSON and is none: not JSON (byte 25)"},
           {orb + "Camera.cy: 255\nDepthMapFactor: 0\n", "DepthMapFactor: must be above 0, is 0"},
           {orb + "Camera.cy: 255\nRGBD.DepthMapFactor: -5000\n", "must be above 0, is -5000"},
           {"m_depthShift = 0\nm_calibrationColorIntrinsic = 517 0 318 0 0 516 255 0 0 0 1 0 0 0 "
            "0 1\n",
            "m_depthShift: must be above 0"},
           {"m_calibrationColorIntrinsic = 517 0 318 9 0 516 255 0 0 0 1 0 0 0 0 1\n",
            "m_calibrationColorIntrinsic: has a fourth column 9 0 0"}}) {
    const auto found = parse_foreign_camera(text, "camera");
    ASSERT_TRUE(found && !found->ok()) << text;
    EXPECT_EQ(found->error().kind, ErrorKind::kConfig);
    EXPECT_NE(found->error().message.find(part), std::string::npos) << found->error().message;
  }
  for (const char* ours : {"fx 517.3\nfy 516.5\ncx 318.6\ncy 255.3\nk1 0.26\n", "fx: 1\nk1: 2\n",
                           "", "{fx: 517.3, fy: 516.5}", "# nothing\n", R"({"fx": 5, "cx": 3})"})
    EXPECT_FALSE(parse_foreign_camera(ours, "camera").has_value()) << ours;
}

std::string camera_refusal(const std::string& text) {
  const auto found = parse_foreign_camera(text, "camera");
  if (found && !found->ok()) return found->error().message;
  return "not refused: " + text;
}

TEST(CameraFormats, NumbersInAnotherOrderAreRefused) {
  for (const char* by_axes : {"525 319.5 525 239.5", "525.1 319.5 524.8 239.5 0.1 0 0 0",
                              "300 320 300 240", "481.2 319.5 -480 239.5", "1400 960 1401 540"})
    EXPECT_NE(camera_refusal(by_axes).find("may be fx cx fy cy and not fx fy cx cy"),
              std::string::npos)
        << camera_refusal(by_axes);
  for (const char* centre_first : {"319.5 239.5 525 525", "960 540 1400 1403 0 0 0 0 0"})
    EXPECT_NE(camera_refusal(centre_first).find("may be cx cy fx fy"), std::string::npos)
        << camera_refusal(centre_first);
  // A wide lens, a Kinect's, pixels that are not square.
  for (const char* in_order :
       {"320 320 320 240", "517.3 516.5 318.6 255.3", "525 700 319.5 239.5", "320.1 321.5 320 240"})
    EXPECT_TRUE(parse_foreign_camera(in_order, "camera")->ok()) << in_order;
}

TEST(CameraFormats, MatricesThatAreNoCamerasAreRefused) {
  EXPECT_EQ(foreign_of("517 1e-14 318\n0 516 255\n0 -1e-17 1.0000000000000002\n").camera.fy, 516);
  for (const auto& [text, part] : std::vector<std::pair<std::string, std::string>>{
           {"517 0 318 0.5\n0 516 255 0\n0 0 1 0\n0 0 0 1\n", "a fourth column 0.5 0 0"},
           {"517 0 318 0\n0 516 255 0\n0 0 1 0\n0 0 1 1\n", "a fourth row that is not 0 0 0 1"},
           {"517 2.5 318\n0 516 255\n0 0 1\n", "has a skew of 2.5"},
           {"517 0 0\n0 516 0\n318 255 1\n", "column by column; write it row by row"},
           {"1 0 0\n0 1 0\n0 0 2\n", "is no matrix fx 0 cx"},
           {"K: [517, 1, 318, 0, 516, 255, 0, 0, 1]\n", "camera_matrix: has a skew of 1"},
           {R"({"intrinsic_matrix": [517, 0, 318, 0, 516, 255, 0, 0, 1]})",
            "intrinsic_matrix: is row by row"}})
    EXPECT_NE(camera_refusal(text).find(part), std::string::npos) << camera_refusal(text);
}

TEST(CameraFormats, WhatIsNoTextIsNamed) {
  testing::TempFolder folder;
  for (const auto& [bytes, part] :
       std::vector<std::pair<std::string, std::string>>{{"\x93NUMPY", "is a NumPy array"},
                                                        {"PK\x03\x04", "is a zip archive"},
                                                        {"\x89PNG\r\n", "is a PNG image"},
                                                        {"\x80\x04\x95", "is a Python pickle"}}) {
    testing::write(folder.path() / "camera", bytes + "\x01");
    const auto camera = read_calibration(folder.path() / "camera");
    ASSERT_FALSE(camera.ok());
    EXPECT_NE(camera.error().message.find("camera: " + part), std::string::npos)
        << camera.error().message;
  }
}

TEST(CameraFormats, CalibrationTxtMayBeOneOfThem) {
  const auto camera = parse_calibration("517.3 516.5 318.6 255.3\n", "calibration.txt");
  ASSERT_TRUE(camera.ok()) << camera.error().message;
  EXPECT_EQ(camera->depth_scale, 5000);
  const auto absurd = parse_calibration("-517.3 516.5 318.6 255.3\n", "calibration.txt");
  ASSERT_FALSE(absurd.ok());
  EXPECT_NE(absurd.error().message.find("calibration.txt: fx"), std::string::npos);
}

}  // namespace
}  // namespace ygslam
