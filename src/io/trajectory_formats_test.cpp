#include "io/trajectory_formats.hpp"

#include <gtest/gtest.h>

#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

constexpr const char* kKitti =
    "1 0 0 0.5 0 1 0 -1 0 0 1 2\n"
    "0 -1 0 1 1 0 0 2 0 0 1 3\n";
constexpr const char* kEuroc =
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
    "q_RS_z [], v_x, v_y, v_z, bw_x, bw_y, bw_z, ba_x, ba_y, ba_z\n"
    "1403636580838555648,4.688319,-1.786938,0.783338,0.534108,-0.153029,-0.827383,-0.082152,0,0,0,"
    "0,0,0,0,0,0\n"
    "1403636580843555328,4.688177,-1.786770,0.787350,0.534640,-0.152990,-0.826976,-0.082863,0,0,0,"
    "0,0,0,0,0,0\n";
constexpr const char* kTum = "# t x y z\n1305031102.5 1 2 3 0 0 0 1\n";

std::string taken_for(const char* text) {
  const auto file = parse_trajectory(text, "f");
  return file.ok() ? file->taken_for : "refused: " + file.error().message;
}

TEST(TrajectoryFormats, AreRecognisedByTheirContent) {
  EXPECT_EQ(taken_for(kKitti), "KITTI (3x4 matrices, no stamps)");
  EXPECT_EQ(taken_for(kEuroc),
            "columns as the header names them, quaternion x y z w in 6, 7, 8, 5, stamps in "
            "nanoseconds");
  EXPECT_EQ(taken_for(std::string(kEuroc).substr(std::string(kEuroc).find('\n') + 1).c_str()),
            "EuRoC (quaternion with w first), stamps in nanoseconds");
  EXPECT_EQ(taken_for(kTum), "");
  EXPECT_EQ(taken_for("1305031102.5,1,2,3,0,0,0,1\n"), "") << "TUM with commas";
}

TEST(TrajectoryFormats, KittiIsARowMajorMatrixWithoutStamps) {
  const auto file = parse_trajectory(kKitti, "f");
  ASSERT_TRUE(file.ok());
  EXPECT_FALSE(file->has_stamps);
  ASSERT_EQ(file->poses.size(), 2U);
  EXPECT_EQ(file->poses[1].stamp.ns, 1);
  EXPECT_TRUE(file->poses[0].T_world_camera.t().isApprox(Vec3(0.5, -1, 2)));
  // A quarter turn about z takes x to y.
  EXPECT_TRUE((file->poses[1].T_world_camera * Vec3(1, 0, 0)).isApprox(Vec3(1, 3, 3)));
}

TEST(TrajectoryFormats, EurocHasNanosecondsAndTheQuaternionWithWFirst) {
  const auto file = parse_trajectory(kEuroc, "f");
  ASSERT_TRUE(file.ok());
  EXPECT_TRUE(file->has_stamps);
  EXPECT_EQ(file->poses[0].stamp.ns, 1403636580838555648);
  const Eigen::Quaterniond q = file->poses[0].T_world_camera.quaternion();
  EXPECT_NEAR(std::abs(q.w()), 0.534108, 1e-5);
  EXPECT_NEAR(q.z() / q.w(), -0.082152 / 0.534108, 1e-5);
}

TEST(TrajectoryFormats, FaultsNameFileAndLine) {
  const auto message = [](const char* text, TrajectoryFormat format) {
    const auto file = parse_trajectory(text, "f", {.format = format});
    return file.ok() ? std::string("ok") : file.error().message;
  };
  EXPECT_EQ(message("1 0 0 0.5 0 1 0 -1 0 0 1\n", TrajectoryFormat::kKitti).substr(0, 5), "f:1: ");
  EXPECT_NE(message("2 0 0 0 0 1 0 0 0 0 1 0\n", TrajectoryFormat::kKitti).find("no rotation"),
            std::string::npos);
  EXPECT_NE(message("-1 0 0 0 0 1 0 0 0 0 1 0\n", TrajectoryFormat::kKitti).find("no rotation"),
            std::string::npos)
      << "a reflection";
  EXPECT_NE(message("1 0 0 nan 0 1 0 0 0 0 1 0\n", TrajectoryFormat::kKitti).find("'nan'"),
            std::string::npos);
  EXPECT_NE(message("1.5,1,2,3,1,0,0,0\n", TrajectoryFormat::kEuroc).find("nanoseconds"),
            std::string::npos);
  EXPECT_NE(message("100,1,2,3,0,0,0,0\n", TrajectoryFormat::kEuroc).find("without length"),
            std::string::npos);
  EXPECT_NE(message("# only a comment\n", TrajectoryFormat::kEuroc).find("no pose"),
            std::string::npos);
}

TEST(TrajectoryFormats, StampsComeFromAFileOfTimes) {
  const testing::TempFolder folder;
  auto file = parse_trajectory(kKitti, "poses");
  ASSERT_TRUE(file.ok());
  const auto times = folder.path() / "times.txt";
  testing::write(times, "0.0\n1.0e-01\n");
  ASSERT_TRUE(add_stamps(times, "poses", *file).ok());
  EXPECT_TRUE(file->has_stamps);
  EXPECT_EQ(file->poses[1].stamp.ns, 100'000'000);
  testing::write(times, "0.0\n");
  EXPECT_NE(add_stamps(times, "poses", *file).error().message.find("1 stamps for the 2 poses"),
            std::string::npos);
  testing::write(times, "0.1\n0.1\n");
  EXPECT_NE(add_stamps(times, "poses", *file).error().message.find(":2: not increasing"),
            std::string::npos);
}

}  // namespace
}  // namespace ygslam
