#include "io/wheel_file.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "io/testing/temp_folder.hpp"
#include "io/wheel_calibration.hpp"

namespace ygslam {
namespace {

TEST(WheelCalibration, IsReadAsItIsWritten) {
  WheelCalibration wheels;
  wheels.T_base_camera = SE3(so3_exp(Vec3(1, -0.2, 0.4)), Vec3(0.1, 0.02, 0.9));
  wheels.way_scale = 1.02;
  wheels.turn_noise = 0.01;
  wheels.time_offset_s = -0.012;
  const auto read =
      parse_wheel_calibration(format_wheel_calibration(wheels, "a robot"), "odom.yaml");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_LT((read->T_base_camera.inverse() * wheels.T_base_camera).log().norm(), 1e-12);
  EXPECT_EQ(read->way_scale, wheels.way_scale);
  EXPECT_EQ(read->turn_scale, 1);
  EXPECT_EQ(read->turn_noise, wheels.turn_noise);
  EXPECT_EQ(read->time_offset_s, wheels.time_offset_s);
}

TEST(WheelCalibration, FaultsNameTheLine) {
  const auto message = [](std::string_view text) {
    const auto read = parse_wheel_calibration(text, "odom.yaml");
    return read.ok() ? std::string("ok") : read.error().message;
  };
  const std::string place = "T_base_camera: [0, 0, 0.3, 0, 0, 0, 1]\n";
  EXPECT_EQ(message(place), "ok");
  EXPECT_EQ(message("way_scale: 1\n"), "odom.yaml: 'T_base_camera' is missing");
  EXPECT_NE(message(place + "way_scale: 1000\n").find("odom.yaml:2: way_scale must lie in"),
            std::string::npos);
  EXPECT_NE(message(place + "turn_scal: 1\n").find("did you mean 'turn_scale'?"),
            std::string::npos);
  EXPECT_NE(message("T_base_camera: [0, 0, 0.3]\n").find("3 numbers, not 7"), std::string::npos);
}

class WheelFileTest : public ::testing::Test {
 protected:
  /// Poses of a robot that drives straight on. @return what is wrong, or how many were read.
  std::string read(double step_s, double step_m, int count = 100) {
    const auto path = folder_.path() / "odom.csv";
    std::ofstream file(path);
    file.precision(12);
    for (int i = 0; i < count; ++i)
      file << 1000 + step_s * i << " " << step_m * i << " 0 0 0 0 0 1\n";
    file.close();
    const auto samples = read_wheels(path);
    return samples.ok() ? std::to_string(samples->size()) : samples.error().message;
  }
  [[nodiscard]] std::string fault(const std::string& what) const {
    return (folder_.path() / "odom.csv").string() + ": " + what;
  }
  ygslam::testing::TempFolder folder_;
};

TEST_F(WheelFileTest, ARobotsPosesAreRead) {
  EXPECT_EQ(read(0.02, 0.01), "100");
  EXPECT_EQ(read(0.1, 0), "100") << "it stands";
}

TEST_F(WheelFileTest, OtherUnitsAreRefused) {
  EXPECT_EQ(read(0.02, 10),
            fault("500 m/s at the median, which no robot drives: metres and seconds are expected"));
  EXPECT_EQ(read(20, 0.01), fault("poses are 20 s apart, which no wheels' are"));
  EXPECT_EQ(read(0.02, 0.01, 1), fault("a single pose; wheels tell many a second"));
}

/// Also where their lines could be those of matrices.
TEST_F(WheelFileTest, LinesThatAreTooShortForAPoseAreRefused) {
  for (const std::string columns : {" 0.5", " 0 0 0.5", " 0 0 0 0 1"}) {
    std::ofstream file(folder_.path() / "odom.csv");
    for (int i = 0; i < 100; ++i) file << 1000 + 0.02 * i << columns << "\n";
    file.close();
    const auto samples = read_wheels(folder_.path() / "odom.csv");
    ASSERT_FALSE(samples.ok());
    EXPECT_NE(samples.error().message.find(" columns; stamps and poses are expected"),
              std::string::npos)
        << samples.error().message;
  }
}

}  // namespace
}  // namespace ygslam
