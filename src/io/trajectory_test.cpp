#include "io/trajectory.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <locale>
#include <numbers>

#include "core/rng.hpp"
#include "io/text.hpp"
#include "io/trajectory_formats.hpp"

namespace ygslam {
namespace {

SE3 random_pose(Rng& rng) {
  Vec6 twist;
  for (int i = 0; i < 6; ++i) twist[i] = rng.uniform(-std::numbers::pi, std::numbers::pi);
  return SE3::exp(twist);
}

std::string refusal_of_lines(const std::string& text) {
  const auto poses = parse_tum_trajectory(text, "est.txt");
  if (poses.ok()) return {};
  EXPECT_EQ(poses.error().kind, ErrorKind::kInput);
  return poses.error().message;
}

TEST(Trajectory, WhatIsWrittenReadsBackTheSame) {
  Rng rng(5);
  std::vector<StampedPose> poses;
  for (int i = 0; i < 300; ++i) {
    poses.push_back({{1'305'031'242'000'000'000 + i * std::int64_t{33'333'000}}, random_pose(rng)});
  }
  const std::string text = format_tum(poses, 6);
  const auto back = parse_tum_trajectory(text, "t");
  ASSERT_TRUE(back.ok()) << back.error().message;
  ASSERT_EQ(back->size(), poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ((*back)[i].stamp, poses[i].stamp);
    const SE3 difference = (*back)[i].T_world_camera.inverse() * poses[i].T_world_camera;
    EXPECT_LT(difference.t().norm(), 2e-9);
    EXPECT_LT(difference.angle(), 1e-8);
  }
  EXPECT_EQ(format_tum(*back, 6).size(), text.size());
}

TEST(Trajectory, LinesHaveTheGivenDecimalsAndAPositiveW) {
  Rng rng(6);
  for (int i = 0; i < 200; ++i) {
    const std::string line = format_tum(StampedPose{{1'500'000'000}, random_pose(rng)}, 4);
    const auto words = words_of(std::string_view(line).substr(0, line.size() - 1));
    ASSERT_EQ(words.size(), 8U);
    EXPECT_EQ(words[0], "1.5000");
    for (std::size_t k = 1; k < 8; ++k) EXPECT_EQ(words[k].size() - words[k].find('.'), 10U);
    EXPECT_NE(words[7].front(), '-');
  }
  EXPECT_EQ(format_tum(StampedPose{{0}, SE3(Mat3::Identity(), {-1e-12, 0, 0})}, 0),
            "0 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 "
            "1.000000000\n");
}

TEST(Trajectory, NoNanIsEverWritten) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<StampedPose> poses = {{{1}, SE3()},
                                          {{2}, SE3(Mat3::Identity(), {nan, 0, 0})},
                                          {{3}, SE3(nan * Mat3::Identity(), Vec3::Zero())},
                                          {{4}, SE3(Mat3::Identity(), {1e300, 0, 0})}};
  const std::string text = format_tum(poses, 6);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
}

TEST(Trajectory, ToleratesCommentsCommasMoreColumnsAndRoundedQuaternions) {
  const auto poses = parse_tum_trajectory(
      "# t x y z\r\n1.0, 1,2,3, 0,0,0,1.01\r\n\n 2 1 2 3 0 0 0 -0.99 9 9\n", "t");
  ASSERT_TRUE(poses.ok()) << poses.error().message;
  ASSERT_EQ(poses->size(), 2U);
  EXPECT_TRUE((*poses)[0].T_world_camera.R().isApprox(Mat3::Identity(), 1e-15));
  EXPECT_TRUE((*poses)[1].T_world_camera.R().isApprox(Mat3::Identity(), 1e-15));
}

TEST(Trajectory, F11IsReturnedInOrderOfTimeWithoutDuplicates) {
  const auto poses =
      parse_tum_trajectory("2 2 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 5 0 0 0 0 0 1\n", "t");
  ASSERT_TRUE(poses.ok());
  ASSERT_EQ(poses->size(), 2U);
  EXPECT_EQ((*poses)[0].T_world_camera.t().x(), 1);
  EXPECT_EQ((*poses)[1].T_world_camera.t().x(), 2);
}

TEST(Trajectory, BadLinesAreRefusedNamingFileAndLine) {
  const std::string good = "1 0 0 0 0 0 0 1\n";
  for (const char* line :
       {"2 0 0 0 0 0 1", "nan 0 0 0 0 0 0 1", "2 nan 0 0 0 0 0 1", "2 0 inf 0 0 0 0 1",
        "2 0 0 1e300 0 0 0 1", "2 0 0 0 0 0 0 0", "2 0 0 0 0 0 0 2", "2 0 0 0 x 0 0 1", "hello"}) {
    const std::string message = refusal_of_lines(good + "# c\n" + line + "\n");
    EXPECT_EQ(message.find("est.txt:3: "), 0U) << line << " -> " << message;
  }
  EXPECT_EQ(refusal_of_lines("# only comments\n"), "est.txt: no pose in the file");
  EXPECT_FALSE(read_tum_trajectory("/nonexistent/est.txt").ok());
}

struct DecimalComma : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
};

TEST(Trajectory, F37IsWrittenAndReadWithPointsInEveryLocale) {
  const StampedPose pose{{1'250'000'000}, SE3(Mat3::Identity(), {0.5, -0.25, 1234.5})};
  const std::string expected = format_tum(pose, 2);
  const std::locale before = std::locale::global(std::locale(std::locale(), new DecimalComma));
  const std::string line = format_tum(pose, 2);
  const auto back = parse_tum_trajectory(line, "t");
  std::locale::global(before);
  EXPECT_EQ(line, expected);
  EXPECT_EQ(back->front().T_world_camera.t(), pose.T_world_camera.t());
}

}  // namespace
}  // namespace ygslam
