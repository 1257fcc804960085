#include "live/run_history.hpp"

#include <gtest/gtest.h>

#include <cstring>

namespace ygslam {
namespace {

void add_frames(RunHistory& history, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i) {
    RgbdFrame frame;
    frame.id = FrameId{i};
    frame.stamp.ns = std::int64_t{1'000'000'000} * i + 500'000'000;
    TrackResult result;
    result.state = i == 1   ? TrackState::kLost
                   : i == 3 ? TrackState::kCoasting
                            : TrackState::kTracking;
    result.provisional = i == 4;
    result.T_odom_camera = SE3(Mat3::Identity(), Vec3(1, 2, 3.0 + i));  // right, down, forward
    result.labels.dynamic_points = 7;
    result.mask_age_frames = -1;
    result.pose_ms = 4.5;
    history.add(frame, result);
  }
}

/// A field of a point.
template <typename T>
T value(const ros::PointCloud2& cloud, std::size_t point, std::string_view name) {
  T read{};
  for (const ros::PointField& field : cloud.point_fields) {
    if (field.name != name) continue;
    std::memcpy(&read, &cloud.data[point * cloud.point_step + field.offset], sizeof read);
    return read;
  }
  ADD_FAILURE() << "no field " << name;
  return read;
}

TEST(RunHistory, TellsOfEachFrameWhereTheCameraWasAndHowItWent) {
  RunHistory history;
  add_frames(history, 5);
  const ros::PointCloud2 told = history.message({});
  ASSERT_EQ(told.width, 5U);
  ASSERT_EQ(told.data.size(), 5 * told.point_step);
  EXPECT_DOUBLE_EQ(value<double>(told, 2, "t"), 2.5);
  EXPECT_EQ(value<std::uint32_t>(told, 2, "frame"), 2U);
  EXPECT_EQ(value<float>(told, 2, "x"), 5) << "axes as REP 103 has them";
  EXPECT_EQ(value<float>(told, 2, "y"), -1);
  EXPECT_EQ(value<float>(told, 2, "z"), -2);
  EXPECT_EQ(value<float>(told, 2, "qw"), 1);
  EXPECT_EQ(value<float>(told, 1, "tracked"), 0);
  EXPECT_EQ(value<float>(told, 2, "tracked"), 1);
  EXPECT_EQ(value<float>(told, 3, "tracked"), 0.5F) << "coasting";
  EXPECT_EQ(value<float>(told, 4, "tracked"), 0.5F) << "provisional";
  EXPECT_EQ(value<float>(told, 2, "pose_ms"), 4.5F);
  EXPECT_EQ(value<float>(told, 2, "dynamic"), 7);
  EXPECT_EQ(value<float>(told, 2, "mask_age"), -1);
}

TEST(RunHistory, IsBoundedAndEvenHoweverLongTheRun) {
  RunHistory history;
  constexpr std::uint32_t kFrames = 5 * RunHistory::kMostFrames + 3;
  add_frames(history, kFrames);
  EXPECT_LE(history.size(), RunHistory::kMostFrames);
  EXPECT_GT(history.size(), RunHistory::kMostFrames / 2);
  const ros::PointCloud2 told = history.message({});
  const auto number = [&](std::size_t i) { return value<std::uint32_t>(told, i, "frame"); };
  EXPECT_EQ(number(0), 0U);
  const std::uint32_t step = number(1);
  for (std::size_t i = 1; i < told.width; ++i) ASSERT_EQ(number(i) - number(i - 1), step) << i;
  EXPECT_GE(number(told.width - 1) + step, kFrames);
  history.clear();
  EXPECT_EQ(history.message({}).width, 0U);
  add_frames(history, 2);
  EXPECT_EQ(history.size(), 2U);
}

}  // namespace
}  // namespace ygslam
