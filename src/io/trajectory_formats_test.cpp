#include "io/trajectory_formats.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

constexpr const char* kEuroc =
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
    "q_RS_z [], v_x, v_y, v_z, bw_x, bw_y, bw_z, ba_x, ba_y, ba_z\n"
    "1403636580838555648,4.688319,-1.786938,0.783338,0.534108,-0.153029,-0.827383,-0.082152,0,0,0,"
    "0,0,0,0,0,0\n"
    "1403636580843555328,4.688177,-1.786770,0.787350,0.534640,-0.152990,-0.826976,-0.082863,0,0,0,"
    "0,0,0,0,0,0\n";
constexpr const char* kTum = "# t x y z\n1305031102.5 1 2 3 0 0 0 1\n";

TEST(TrajectoryFormats, AreRecognisedByTheirContent) {
  EXPECT_EQ(recognise_trajectory(kEuroc), TrajectoryFormat::kEuroc);
  EXPECT_EQ(recognise_trajectory(kTum), TrajectoryFormat::kTum);
  EXPECT_EQ(recognise_trajectory("1305031102.5,1,2,3,0,0,0,1\n"), TrajectoryFormat::kTum)
      << "TUM with commas";
  EXPECT_EQ(recognise_trajectory(""), TrajectoryFormat::kTum);
}

TEST(TrajectoryFormats, EurocHasNanosecondsAndTheQuaternionWithWFirst) {
  const auto poses = parse_trajectory(kEuroc, "f");
  ASSERT_TRUE(poses.ok());
  EXPECT_EQ(poses->front().stamp.ns, 1403636580838555648);
  const Eigen::Quaterniond q = poses->front().T_world_camera.quaternion();
  EXPECT_NEAR(std::abs(q.w()), 0.534108, 1e-5);
  EXPECT_NEAR(q.z() / q.w(), -0.082152 / 0.534108, 1e-5);
}

TEST(TrajectoryFormats, FaultsNameFileAndLine) {
  const auto message = [](const char* text, TrajectoryFormat format) {
    const auto file = parse_trajectory(text, "f", format);
    return file.ok() ? std::string("ok") : file.error().message;
  };
  EXPECT_NE(message("1.5,1,2,3,1,0,0,0\n", TrajectoryFormat::kEuroc).find("nanoseconds"),
            std::string::npos);
  EXPECT_NE(message("100,1,2,3,0,0,0,0\n", TrajectoryFormat::kEuroc).find("without length"),
            std::string::npos);
  EXPECT_NE(message("# only a comment\n", TrajectoryFormat::kEuroc).find("no pose"),
            std::string::npos);
}

}  // namespace
}  // namespace ygslam
