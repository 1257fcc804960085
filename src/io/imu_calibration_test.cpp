#include "io/imu_calibration.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "io/imu_checks.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

TEST(ImuCalibration, IsReadBackToTheBit) {
  ImuCalibration imu;
  imu.T_camera_imu = SE3(so3_exp(Vec3(0.3, -0.2, 1)), Vec3(0.02, -0.01, 0.005));
  imu.noise = {400, 2.4e-4, 1.2e-3, 2e-5, 3e-4};
  imu.gyro_range_radps = 17.4;
  imu.accel_range_mps2 = 39.2;
  imu.time_offset_s = -0.004;
  const auto read = parse_imu_calibration(format_imu_calibration(imu, "a test"), "imu.yaml");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->noise.rate_hz, 400);
  EXPECT_EQ(read->noise.gyro_noise_radps_sqrthz, 2.4e-4);
  EXPECT_EQ(read->noise.gyro_walk_radps2_sqrthz, 2e-5);
  EXPECT_EQ(read->noise.accel_noise_mps2_sqrthz, 1.2e-3);
  EXPECT_EQ(read->noise.accel_walk_mps3_sqrthz, 3e-4);
  EXPECT_EQ(read->gyro_range_radps, 17.4);
  EXPECT_EQ(read->accel_range_mps2, 39.2);
  EXPECT_EQ(read->time_offset_s, -0.004);
  EXPECT_LT((read->T_camera_imu.inverse() * imu.T_camera_imu).log().norm(), 1e-12);
  imu.time_offset_s.reset();
  EXPECT_FALSE(parse_imu_calibration(format_imu_calibration(imu, "a test"), "")->time_offset_s);
}

TEST(ImuCalibration, AnotherRateThanTheReadingsIsDoubted) {
  std::vector<ImuSample> at_10_hz;
  for (std::int64_t i = 0; i < 30; ++i)
    at_10_hz.push_back({{i * 100'000'000}, Vec3::Zero(), Vec3(0, 0, 9.8)});
  const std::string rest = format_imu_calibration({}, "a test").substr(sizeof("# a test"));
  const auto doubt = [&](const std::string& rate_line) {
    const auto imu = parse_imu_calibration(rate_line + rest.substr(rest.find('\n') + 1), "");
    EXPECT_TRUE(imu.ok()) << imu.error().message;
    return doubt_about_rate(at_10_hz, *imu);
  };
  EXPECT_EQ(doubt("rate_hz: 200\n"),
            "rate_hz: 200 is said of readings at 10 Hz (another sensor's file?)");
  EXPECT_FALSE(doubt("rate_hz: 5\n").empty());
  EXPECT_EQ(doubt("rate_hz: 12\n"), "");
  EXPECT_EQ(doubt(""), "") << "the 200 is assumed";
}

// As Kalibr's wiki shows them ("Yaml formats").
constexpr std::string_view kKalibrsImu = R"(#Accelerometers
accelerometer_noise_density: 1.86e-03   #Noise density (continuous-time)
accelerometer_random_walk:   4.33e-04   #Bias random walk
#Gyroscopes
gyroscope_noise_density:     1.87e-04   #Noise density (continuous-time)
gyroscope_random_walk:       2.66e-05   #Bias random walk
rostopic:                    /imu0      #the IMU ROS topic
update_rate:                 400.0      #Hz (for discretization of the values above)
)";
constexpr std::string_view kKalibrsChain = R"(cam0:
  T_cam_imu:
  - [0.0, -1.0, 0.0, 0.07]
  - [0.0, 0.0, -1.0, -0.02]
  - [1.0, 0.0, 0.0, 0.004]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: []
  camera_model: pinhole
  distortion_coeffs: [-0.27, 0.07, 0.0009, 0.0001]
  intrinsics: [461.6, 460.2, 362.7, 246.0]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
  timeshift_cam_imu: -0.012
)";

TEST(ImuCalibration, KalibrsIsRead) {
  const std::string both = std::string(kKalibrsImu) + std::string(kKalibrsChain);
  const auto imu = parse_imu_calibration(both, "imu.yaml");
  ASSERT_TRUE(imu.ok()) << imu.error().message;
  EXPECT_EQ(imu->noise.rate_hz, 400);
  EXPECT_TRUE(imu->rate_is_said);
  EXPECT_EQ(imu->noise.gyro_noise_radps_sqrthz, 1.87e-4);
  EXPECT_EQ(imu->noise.gyro_walk_radps2_sqrthz, 2.66e-5);
  EXPECT_EQ(imu->noise.accel_noise_mps2_sqrthz, 1.86e-3);
  EXPECT_EQ(imu->noise.accel_walk_mps3_sqrthz, 4.33e-4);
  // x of the IMU looks ahead, which is z of the camera; IMU to camera, as ours.
  EXPECT_LT((imu->T_camera_imu * Vec3(1, 0, 0) - Vec3(0.07, -0.02, 1.004)).norm(), 1e-12);
  // t_imu = t_cam + shift: a stamp of the IMU minus that of the camera, as ours.
  EXPECT_EQ(imu->time_offset_s, -0.012);
  const auto place_alone = parse_imu_calibration(kKalibrsChain, "camchain-imucam.yaml");
  ASSERT_TRUE(place_alone.ok()) << place_alone.error().message;
  EXPECT_EQ(place_alone->noise.gyro_noise_radps_sqrthz, ImuNoise().gyro_noise_radps_sqrthz);
  EXPECT_FALSE(place_alone->rate_is_said);
}

TEST(ImuCalibration, KalibrsMayBeWrittenByOthers) {
  std::string below =
      "%YAML:1.0\nimu0:\n  T_i_b:\n    - [1, 0, 0, 0]\n    - [0, 1, 0, 0]\n"
      "    - [0, 0, 1, 0]\n    - [0, 0, 0, 1]\n  model: calibrated\n";
  for (const TextLine& line : data_lines(kKalibrsImu))
    below += "  " + std::string(line.text) + "\n";
  const auto imu = parse_imu_calibration(
      below +
          "cam0:\n  T_cam_imu: [[1, 0, 0, 0.1], [0, 1, 0, 0],\n    [0, 0, 1, 0], [0, 0, 0, 1]]\n",
      "imu.yaml");
  ASSERT_TRUE(imu.ok()) << imu.error().message;
  EXPECT_EQ(imu->T_camera_imu.t(), Vec3(0.1, 0, 0));
  EXPECT_EQ(imu->noise.rate_hz, 400);
  EXPECT_FALSE(imu->time_offset_s);
  const auto dashes = parse_imu_calibration(
      "T_cam_imu:\n- - 1\n  - 0\n  - 0\n  - -0.5\n- - 0\n  - 1\n  - 0\n  - 0\n- - 0\n  - 0\n  - 1\n"
      "  - 0\n- - 0\n  - 0\n  - 0\n  - 1\n",
      "imu.yaml");
  ASSERT_TRUE(dashes.ok()) << dashes.error().message;
  EXPECT_EQ(dashes->T_camera_imu.t(), Vec3(-0.5, 0, 0));
}

TEST(ImuCalibration, WhatOfKalibrsIsNotReadIsTold) {
  const std::string both = std::string(kKalibrsImu) + std::string(kKalibrsChain);
  const auto refusal = [](const std::string& text) {
    const auto read = parse_imu_calibration(text, "k.yaml");
    if (read.ok()) return std::string("accepted");
    EXPECT_EQ(read.error().kind, ErrorKind::kConfig);
    return read.error().message;
  };
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = both;
    text.replace(text.find(from), from.size(), to);
    return refusal(text);
  };
  EXPECT_EQ(refusal(std::string(kKalibrsImu)),
            "k.yaml: Kalibr's imu.yaml does not say where the IMU is: append the lines of the "
            "camchain that kalibr_calibrate_imu_camera writes (T_cam_imu)");
  EXPECT_EQ(with("rostopic", "model: scale-misalignment\nrostopic"),
            "k.yaml: model: 'scale-misalignment' is not read: only calibrated");
  EXPECT_NE(refusal("imu0:\n  accelerometers:\n    M: 1\n  gyroscopes:\n    M: 1\n"
                    "  model: scale-misalignment\n  update_rate: 200\n")
                .find("model: 'scale-misalignment'"),
            std::string::npos);
  EXPECT_EQ(with("400.0", "0"), "k.yaml: update_rate must lie in 1 to 100000 (Hz), is 0");
  EXPECT_EQ(with("accelerometer_random_walk", "# a"),
            "k.yaml: 'accelerometer_random_walk' is missing: noise densities and random walks are "
            "there in part only");
  EXPECT_NE(with("1.0, 0.0, 0.07", "1.1, 0.0, 0.07").find("T_cam_imu: four rows of a rigid"),
            std::string::npos);
  for (const char* far : {", 700]", ", nan]"})
    EXPECT_NE(with(", 0.07]", far).find("in metres"), std::string::npos);
  EXPECT_NE(with("  - [0.0, 0.0, 0.0, 1.0]\n", "").find("T_cam_imu"), std::string::npos);
  EXPECT_EQ(with("-0.012", "soon"), "k.yaml: timeshift_cam_imu: 'soon' is not a finite number");
  EXPECT_NE(refusal(both + "cam1:\n  rostopic: /cam1\n").find("several cameras"),
            std::string::npos);
  EXPECT_NE(refusal(both + "imu0:\n  model: calibrated\nimu1:\n  model: calibrated\n")
                .find("several IMUs"),
            std::string::npos);
  EXPECT_NE(refusal(both + "imu0:\n  update_rate: 200\n").find("two values of update_rate"),
            std::string::npos);
}

TEST(ImuCalibration, OfKalibrsAnySingleCameraAndImuIsRead) {
  std::string chain(kKalibrsChain);
  chain.replace(0, 4, "cam1");
  chain +=
      "  T_cn_cnm1:\n  - [1.0, 0.0, 0.0, 0.1]\n  - [0.0, 1.0, 0.0, 0.0]\n"
      "  - [0.0, 0.0, 1.0, 0.0]\n  - [0.0, 0.0, 0.0, 1.0]\n";
  const auto imu = parse_imu_calibration(std::string(kKalibrsImu) + chain, "k.yaml");
  ASSERT_TRUE(imu.ok()) << imu.error().message;
  EXPECT_EQ(imu->T_camera_imu.t(), Vec3(0.07, -0.02, 0.004));
  const std::string rows = "    - [0, 1, 0, 0]\n    - [0, 0, 1, 0]\n    - [0, 0, 0, 1]\n";
  const auto of_imu1 = [&](const std::string& first_row, const std::string& offset_s) {
    return parse_imu_calibration("imu1:\n  T_i_b:\n    - " + first_row + "\n" + rows +
                                     "  update_rate: 100\n  time_offset: " + offset_s + "\n" +
                                     chain,
                                 "k.yaml");
  };
  const auto same = of_imu1("[1, 0, 0, 0]", "0.0");
  ASSERT_TRUE(same.ok()) << same.error().message;
  EXPECT_EQ(same->noise.rate_hz, 100);
  // T_cam_imu and its shift are of the first IMU.
  const auto moved = of_imu1("[1, 0, 0, 0.1]", "0.0"), late = of_imu1("[1, 0, 0, 0]", "0.02");
  ASSERT_FALSE(moved.ok());
  EXPECT_EQ(moved.error().message,
            "k.yaml: T_i_b: is of an IMU beside the one that T_cam_imu is of, which is not read");
  ASSERT_FALSE(late.ok());
  EXPECT_EQ(late.error().message.substr(0, 20), "k.yaml: time_offset:");
}

TEST(ImuCalibration, KeysOfOursBesideKalibrsAreRead) {
  const auto read = [](const std::string& ours) {
    return parse_imu_calibration(ours + std::string(kKalibrsImu) + std::string(kKalibrsChain),
                                 "k.yaml");
  };
  const auto imu = read("gyroscope_range: 17\naccelerometer_range: 39\nrate_hz: 400.0\n");
  ASSERT_TRUE(imu.ok()) << imu.error().message;
  EXPECT_EQ(imu->gyro_range_radps, 17);
  EXPECT_EQ(imu->accel_range_mps2, 39);
  const auto late = parse_imu_calibration(
      "T_cam_imu: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
      "time_offset_s: 0.02\nrate_hz: 100\n",
      "k.yaml");
  ASSERT_TRUE(late.ok()) << late.error().message;
  EXPECT_EQ(late->time_offset_s, 0.02);
  EXPECT_TRUE(late->rate_is_said);
  EXPECT_EQ(late->noise.rate_hz, 100);
  const auto both = read("time_offset_s: 0.02\n");
  ASSERT_FALSE(both.ok());
  EXPECT_EQ(both.error().message, "k.yaml: timeshift_cam_imu and time_offset_s differ");
}

TEST(ImuCalibration, KeysOfKalibrsThatAreMisspeltOrGivenTwiceAreRefused) {
  const std::string chain(kKalibrsChain);
  const auto refusal = [](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    const auto read = parse_imu_calibration(text, "k.yaml");
    return read.ok() ? "accepted" : read.error().message;
  };
  EXPECT_EQ(refusal(chain, "timeshift_", "timeshif_"),
            "k.yaml: unknown key 'timeshif_cam_imu', did you mean 'timeshift_cam_imu'?");
  EXPECT_EQ(refusal(std::string(kKalibrsImu) + chain, "gyroscope_noise_d", "gyro_noise_d"),
            "k.yaml: unknown key 'gyro_noise_density', did you mean 'gyroscope_noise_density'?");
  EXPECT_EQ(refusal(std::string(kKalibrsImu) + chain, "T_cam_imu", "T_cam_im"),
            "k.yaml: unknown key 'T_cam_im', did you mean 'T_cam_imu'?");
  EXPECT_EQ(refusal(chain, "  timeshift_", "  timeshift_cam_imu: 0.5\n  timeshift_"),
            "k.yaml: two values of timeshift_cam_imu");
  for (const char* other : {"line_delay: 1e-5", "sensor_type: imu", "comment: ours", "T_BS: 0"})
    EXPECT_EQ(refusal(chain, "camera_model: pinhole", other), "accepted");
}

TEST(ImuCalibration, FaultsAreNamed) {
  const std::string good = format_imu_calibration({}, "a test");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  const auto expect = [](const std::string& text, const std::string& why) {
    const auto read = parse_imu_calibration(text, "imu.yaml");
    ASSERT_FALSE(read.ok()) << why;
    EXPECT_EQ(read.error().kind, ErrorKind::kConfig);
    EXPECT_NE(read.error().message.find(why), std::string::npos) << read.error().message;
  };
  expect(with("gyroscope_range", "gyroscop_range"),
         "imu.yaml:7: unknown key 'gyroscop_range', did you mean");
  expect(good + "rate_hz: 100\n", "imu.yaml:10: 'rate_hz' is given twice");
  expect(with("rate_hz: 200", "rate_hz: fast"),
         "imu.yaml:2: rate_hz: 'fast' is not a finite number");
  expect(with("rate_hz: 200", "rate_hz: 0"), "rate_hz must lie in 1 to 100000");
  expect(with("gyroscope_noise_density: 0.00024", "gyroscope_noise_density: 0"),
         "gyroscope_noise_density must lie in 1e-09 to 1");
  expect(with("accelerometer_noise_density: 0.0012", "accelerometer_noise_density: 0"),
         "accelerometer_noise_density must lie in 1e-09 to 10");
  for (const std::string key : {"gyroscope_random_walk", "accelerometer_random_walk"})
    expect(key + ": 0\n" + with(key, "# " + key), key + " must lie in 1e-09 to 1");
  expect(with("gyroscope_noise_density: ", "# "), "'gyroscope_noise_density' is missing");
  expect(with("T_camera_imu", "# T_camera_imu"), "'T_camera_imu' is missing");
  expect(with("0, 0, 0, 1]", "0, 0, 0, 2]"), "quaternion of length 2");
  expect(with("0, 0, 0, 1]", "0, 0, 0]"), "6 numbers, not 7");
  expect(with("[0, 0, 0,", "[0, 0, 200,"), "farther than 100 m");
  std::string of_old_macs = good;
  std::ranges::replace(of_old_macs, '\n', '\r');
  expect(of_old_macs, "imu.yaml:1: a carriage return within the line");
  expect("hello\n", "imu.yaml:1: a line 'key: value' is expected");
}

}  // namespace
}  // namespace ygslam
