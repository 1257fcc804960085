#include "io/imu_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "core/log.hpp"
#include "core/rng.hpp"
#include "io/imu_checks.hpp"
#include "io/testing/temp_folder.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// What is logged while it lives.
class Warnings {
 public:
  Warnings()
      : sink_(std::make_shared<log::Sink>(
            [this](log::Level, const std::string& line) { text_ += line + "\n"; })) {}
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
  log::ScopedSink sink_;
};

/// A sensor that nods and turns in a hand for eight seconds.
std::vector<ImuSample> nodding() {
  std::vector<ImuSample> samples;
  Rng rng(5);
  Mat3 R_world_imu = Mat3::Identity();
  constexpr double kRate_hz = 100;
  for (int i = 0; i < 800; ++i) {
    const double t_s = i / kRate_hz;
    ImuSample sample;
    sample.stamp = {1'403'636'579'763'555'584 + static_cast<std::int64_t>(i) * 10'000'000};
    sample.angular_velocity_radps =
        Vec3(0.9 * std::cos(2 * t_s), 0.6 * std::sin(1.3 * t_s), 0.5 * std::cos(0.7 * t_s));
    sample.specific_force_mps2 = R_world_imu.transpose() * Vec3(0, 0, kStandardGravity_mps2);
    for (int axis = 0; axis < 3; ++axis) sample.specific_force_mps2[axis] += rng.normal(0, 0.4);
    R_world_imu *= so3_exp(sample.angular_velocity_radps / kRate_hz);
    samples.push_back(sample);
  }
  return samples;
}

std::string tum_text(const std::vector<ImuSample>& samples, double gyro = 1, double accel = 1) {
  std::string text;
  for (const ImuSample& s : samples) {
    const Vec3 w = gyro * s.angular_velocity_radps, a = accel * s.specific_force_mps2;
    text += fmt::format("{}.{:09} {} {} {} {} {} {}\n", s.stamp.ns / 1'000'000'000,
                        s.stamp.ns % 1'000'000'000, w.x(), w.y(), w.z(), a.x(), a.y(), a.z());
  }
  return text;
}

void expect_same(const std::vector<ImuSample>& a, const std::vector<ImuSample>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].stamp, b[i].stamp);
    EXPECT_EQ(a[i].angular_velocity_radps, b[i].angular_velocity_radps);
    EXPECT_EQ(a[i].specific_force_mps2, b[i].specific_force_mps2);
  }
}

std::string error_of(const std::string& text) {
  const auto samples = parse_imu(text, "imu.csv");
  if (samples.ok()) return "(taken)";
  EXPECT_EQ(samples.error().kind, ErrorKind::kInput);
  EXPECT_EQ(samples.error().message.find('\n'), std::string::npos);
  return samples.error().message;
}

void expect_refused(const std::string& text, const std::string& why) {
  EXPECT_NE(error_of(text).find(why), std::string::npos) << error_of(text);
}

TEST(ImuFile, WhatIsWrittenIsReadBackToTheBit) {
  const Warnings warnings;
  const auto samples = nodding();
  const auto read = parse_imu(format_imu(samples), "imu.csv");
  ASSERT_TRUE(read.ok()) << read.error().message;
  expect_same(*read, samples);
  EXPECT_EQ(warnings.text(), "");
}

TEST(ImuFile, EurocsFileIsReadFromDisk) {
  const testing::TempFolder folder;
  testing::write(
      folder.path() / "data.csv",
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\r\n"
      "1403636579758555392,-0.099134701513277898,0.14730578886832138,"
      "0.02722713633111154,8.1476917083333333,-0.37592158333333331,-2.4026292499999999\r\n"
      "1403636579763555584,-0.099134701513277898,0.14032447186034408,"
      "0.029321531433504733,8.033280791666666,-0.40861041666666664,-2.4026292499999999\r\n");
  const auto read = read_imu(folder.path() / "data.csv");
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ((*read)[0].stamp.ns, 1403636579758555392);
  EXPECT_EQ((*read)[0].angular_velocity_radps.y(), 0.14730578886832138);
  EXPECT_EQ((*read)[1].specific_force_mps2.x(), 8.033280791666666);
  const auto missing = read_imu(folder.path() / "none.csv");
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().message.find("none.csv: no such file"), std::string::npos);
}

// A camera's clock may start anywhere: stamps of 1000 s are nanoseconds because the header says so.
TEST(ImuFile, HeaderTellsTheUnitOfStamps) {
  const auto read = parse_imu(
      "#timestamp [ns],wx,wy,wz,ax,ay,az\n1000000000000,0,0,0,0,0,9.8\n"
      "1000005000000,0,0,0,0,0,9.8\n",
      "imu.csv");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ((*read)[0].stamp.ns, 1'000'000'000'000);
}

TEST(ImuFile, LinesInSecondsAreRead) {
  const auto samples = nodding();
  const auto read = parse_imu("# t wx wy wz ax ay az\n" + tum_text(samples), "imu.txt");
  ASSERT_TRUE(read.ok()) << read.error().message;
  expect_same(*read, samples);
  const auto bare = parse_imu(tum_text(samples), "imu.txt");
  ASSERT_TRUE(bare.ok());
  expect_same(*bare, samples);
}

TEST(ImuFile, HeaderNamesColumnsInAnyOrder) {
  for (const char* header :
       {"timestamp,ax,ay,az,gx,gy,gz,temperature",
        "Time,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,T",
        "# stamp,linear_acceleration_x,linear_acceleration_y,linear_acceleration_z,"
        "angular_velocity_x,angular_velocity_y,angular_velocity_z,mag"}) {
    const auto read = parse_imu(
        std::string(header) + "\n1.00,0,0.5,9.7,0.1,0.2,0.3,21\n1.01,0,0.5,9.8,0.1,0.2,0.3,21\n",
        "a.csv");
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ((*read)[0].angular_velocity_radps, Vec3(0.1, 0.2, 0.3)) << header;
    EXPECT_EQ((*read)[1].specific_force_mps2, Vec3(0, 0.5, 9.8)) << header;
    EXPECT_EQ((*read)[1].stamp.ns, 1'010'000'000) << header;
  }
}

TEST(ImuFile, TumsAccelerometerIsReadAsOneAlone) {
  const std::string text =
      "# accelerometer data\n# file: 'rgbd_dataset_freiburg1_xyz.bag'\n# timestamp ax ay az\n"
      "1305031098.628217 -0.137292 -9.304723 -2.926341\n"
      "1305031098.630224 -0.131295 -9.351402 -2.901201\n";
  const auto read = parse_accelerometer(text, "accelerometer.txt");
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ((*read)[1].stamp.ns, 1'305'031'098'630'224'000);
  EXPECT_EQ((*read)[0].specific_force_mps2, Vec3(-0.137292, -9.304723, -2.926341));
  expect_refused(text, "imu.csv:4: an accelerometer alone");
  const auto of_imu = parse_accelerometer(format_imu(nodding()), "imu.csv");
  ASSERT_TRUE(of_imu.ok());
  EXPECT_EQ(of_imu->front().specific_force_mps2, nodding().front().specific_force_mps2);
}

TEST(ImuFile, StampsOutOfOrderAreSortedAndEqualOnesLeftOutWithAWarning) {
  auto samples = nodding();
  auto mixed = samples;
  std::swap(mixed[100], mixed[101]);
  mixed.insert(mixed.begin() + 300, mixed[299]);
  const Warnings warnings;
  const auto read = parse_imu(format_imu(mixed), "imu.csv");
  ASSERT_TRUE(read.ok());
  expect_same(*read, samples);
  EXPECT_NE(warnings.text().find("imu.csv:103: stamps go back"), std::string::npos)
      << warnings.text();
  EXPECT_NE(warnings.text().find("1 readings have the stamp of another"), std::string::npos);
}

TEST(ImuFile, OtherUnitsAreToldByGravity) {
  const auto samples = nodding();
  expect_refused(tum_text(samples, 1, 1 / 9.80665), "units of g");
  expect_refused(tum_text(samples, 1, 1000 / 9.80665), "thousandths of g");
  expect_refused(tum_text(samples, 1, 0.01), "no gravity in them");
  expect_refused(tum_text(samples, 1, 20), "not gravity's 9.81");
  expect_refused(tum_text(samples, 1 / kDegree, 1), "angular velocities in degrees");
  // Nothing turns: nothing can be told.
  std::string still;
  for (int i = 0; i < 500; ++i) still += fmt::format("{:.3f} 0.3 0 0 0 0 9.8\n", 1 + i * 0.01);
  EXPECT_EQ(error_of(still), "(taken)");
}

TEST(ImuFile, AccelerationsBeforeAngularVelocitiesAreTold) {
  auto samples = nodding();
  for (ImuSample& s : samples) std::swap(s.angular_velocity_radps, s.specific_force_mps2);
  expect_refused(tum_text(samples), "accelerations stand before angular velocities");
}

TEST(ImuFile, AxesThatDoNotBelongTogetherGiveAWarning) {
  auto samples = nodding();
  {
    const Warnings none;
    ASSERT_TRUE(parse_imu(format_imu(samples), "imu.csv").ok());
    EXPECT_EQ(none.text(), "");
  }
  for (ImuSample& s : samples) s.angular_velocity_radps.head<2>() *= -1;
  const Warnings warnings;
  ASSERT_TRUE(parse_imu(format_imu(samples), "imu.csv").ok());
  EXPECT_NE(warnings.text().find("does not turn gravity"), std::string::npos);
}

TEST(ImuFile, WholeNanosecondsOfAnyClockAreReadWhateverStandsBetweenColumns) {
  auto samples = nodding();
  for (ImuSample& s : samples) s.stamp.ns -= 1'403'635'579'763'555'584;  // from 1000 s on
  const std::string eurocs = format_imu(samples);
  for (const char separator : {',', ';', '\t'}) {
    std::string text = eurocs.substr(eurocs.find('\n') + 1);
    std::ranges::replace(text, ',', separator);
    const auto read = parse_imu(text, "imu.csv");
    ASSERT_TRUE(read.ok()) << read.error().message;
    expect_same(*read, samples);
  }
  expect_refused("#timestamp [ns],wx,wy,wz,ax,ay,az\n999.9,0,0,0,0,0,9.8\n",
                 "imu.csv:2: '999.9' is no stamp in nanoseconds, which the header names");
}

TEST(ImuFile, BadLinesAreNamed) {
  const std::string good = "1.00 0 0 0 0 0 9.8\n1.01 0 0 0 0 0 9.8\n";
  expect_refused("", "imu.csv: no readings");
  expect_refused("# t wx wy wz ax ay az\n", "no readings");
  expect_refused(good + "1.02 0 0 0 0 0\n", "imu.csv:3: 6 columns, not 7");
  expect_refused(good + "1.02 0 0 nan 0 0 9.8\n", "imu.csv:3: 'nan' is no finite number");
  expect_refused(good + "1.02 0 0 1e300 0 0 9.8\n", "imu.csv:3: '1e300'");
  expect_refused(good + "soon 0 0 0 0 0 9.8\n", "imu.csv:3: 'soon' is no stamp");
  expect_refused("1 2 3\n", "imu.csv:1: 3 columns");
  expect_refused("name,of,nothing\n1,2,3\n", "imu.csv:1: the header does not name");
  expect_refused("1 0 0 0 0 0 9.8\n2 0 0 0 0 0 9.8\n", "1 s apart");
  expect_refused("\x93NUMPY\x01", "NumPy");
  expect_refused("1.00 0 0 0 0 0 9.8\r1.01 0 0 0 0 0 9.8\r", "carriage return");
  expect_refused("1,00;0,5;0,5;0,5;0,5;0,5;9,8\n", "decimal commas");
}

}  // namespace
}  // namespace ygslam
