#include "bag/stream_odometry.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <thread>

namespace ygslam {
namespace {

constexpr std::int64_t kStep_ns = 20'000'000;

Bytes odometry_at(double x_m) {
  ros::Odometry odometry;
  odometry.child_frame_id = "base";
  odometry.pose.position.x = x_m;
  return to_cdr(odometry);
}

/// Stamps count steps of 20 ms, on each of which it goes on.
struct WheelsWritten {
  StreamOdometry odometry;

  void add(std::int64_t step, const std::string& topic = "/odom", double way_m = 0.01) {
    put({step * kStep_ns}, topic, way_m * static_cast<double>(step), 0);
  }
  void put(Timestamp stamp, const std::string& topic, double x_m, std::int64_t shift_ns) {
    const Bytes bytes = odometry_at(x_m);
    odometry.add({topic, "nav_msgs/Odometry", Layout::kCdr}, {0, stamp, bytes, {}}, shift_ns);
  }
  void hand_out(std::uint32_t frame) { odometry.hand_out(FrameId{frame}); }
  std::vector<std::int64_t> taken(std::uint32_t frame) {
    std::vector<std::int64_t> steps;
    for (const OdometrySample& sample : odometry.take(FrameId{frame}))
      steps.push_back(sample.stamp.ns / kStep_ns);
    return steps;
  }
};
using Steps = std::vector<std::int64_t>;

/// One after the other.
std::string told_by(StreamOdometry& odometry) {
  std::string all;
  for (const std::string& doubt : odometry.take_doubts()) all += doubt + "\n";
  return all;
}

TEST(StreamOdometry, PosesBelongToTheFrameTheyCameBefore) {
  WheelsWritten written;
  written.add(1);
  written.add(1, "/other");
  ASSERT_TRUE(written.odometry.use("/odom", {}).ok());
  written.add(2);
  written.add(2, "/other");
  written.hand_out(0);
  written.add(3);
  written.hand_out(1);
  EXPECT_EQ(written.taken(0), Steps({1, 2}));
  EXPECT_EQ(written.taken(1), Steps({3}));
}

TEST(StreamOdometry, NoneAreKeptThatNobodyWants) {
  WheelsWritten written;
  written.add(1);
  written.hand_out(0);
  written.add(2);
  written.hand_out(1);
  EXPECT_EQ(written.taken(1), Steps());
}

TEST(StreamOdometry, TheOnlyTopicIsTakenElseOneIsChosen) {
  WheelsWritten written;
  EXPECT_FALSE(written.odometry.use("", {}).ok());
  written.add(1);
  const auto only = written.odometry.use("", {});
  ASSERT_TRUE(only.ok());
  EXPECT_EQ(*only, "/odom");
  WheelsWritten two;
  two.add(1);
  EXPECT_FALSE(two.odometry.use("", {MotionTopic{"/later"}}).ok());
  EXPECT_FALSE(two.odometry.use("/no", {MotionTopic{"/later"}}).ok());
  ASSERT_TRUE(two.odometry.use("/later", {MotionTopic{"/later"}}).ok()) << "it was announced";
  two.add(2, "/later");
  two.hand_out(0);
  EXPECT_EQ(two.taken(0), Steps({2}));
}

/// It is told as a whole again and again: of no use while it grows.
TEST(StreamOdometry, APathIsNone) {
  WheelsWritten written;
  ros::Path path;
  path.poses.emplace_back();
  const Bytes bytes = to_cdr(path);
  const BagTopic topic{"/path", "nav_msgs/Path", Layout::kCdr};
  written.odometry.add(topic, {0, {kStep_ns}, bytes, {}}, 0);
  EXPECT_FALSE(written.odometry.use("/path", {}).ok());
  written.add(1);
  const auto only = written.odometry.use("", {});
  ASSERT_TRUE(only.ok());
  EXPECT_EQ(*only, "/odom");
}

TEST(StreamOdometry, AFrameOfTfIsOneToo) {
  const BagTopic tf{"/tf", "tf2_msgs/TFMessage", Layout::kCdr};
  ros::TransformStamped base, other;
  base.header.stamp.sec = other.header.stamp.sec = 1;
  base.child_frame_id = "base";
  other.child_frame_id = "wheel";
  const Bytes bytes = to_cdr(ros::TfMessage{{base, other}});
  StreamOdometry odometry;
  odometry.add(tf, {0, {1}, bytes, {}}, 0);
  ASSERT_TRUE(odometry.use("/tf:base", {}).ok());
  odometry.add(tf, {0, {1}, bytes, {}}, 0);
  odometry.hand_out(FrameId{0});
  EXPECT_EQ(odometry.take(FrameId{0}).size(), 2U);
}

TEST(StreamOdometry, MillimetresAreTold) {
  for (const auto& [way_m, word] :
       {std::pair(0.01, ""), std::pair(10.0, "which no robot drives")}) {
    WheelsWritten written;
    ASSERT_TRUE(written.odometry.use("/odom", {MotionTopic{"/odom"}}).ok());
    std::string doubt;
    for (std::int64_t step = 0; step < 200; ++step) {
      written.add(step, "/odom", way_m);
      doubt += told_by(written.odometry);
    }
    EXPECT_NE(doubt.find(word), std::string::npos) << doubt;
    EXPECT_EQ(doubt.empty(), std::string(word).empty()) << doubt;
    EXPECT_LE(std::count(doubt.begin(), doubt.end(), ':'), 2) << "once";
  }
}

TEST(StreamOdometry, StampsThatCannotBeShiftedAreLeftOut) {
  WheelsWritten written;
  ASSERT_TRUE(written.odometry.use("/odom", {MotionTopic{"/odom"}}).ok());
  written.put({10 * kStep_ns}, "/odom", 0, 5 * kStep_ns);
  written.put({std::numeric_limits<std::int64_t>::max() - 1}, "/odom", 0, 5 * kStep_ns);
  written.put({11 * kStep_ns}, "/odom", std::numeric_limits<double>::quiet_NaN(), 0);
  written.hand_out(0);
  EXPECT_EQ(written.taken(0), Steps({15}));
}

TEST(StreamOdometry, PosesThatAreNoneAreCounted) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  WheelsWritten written;
  for (std::int64_t step = 0; step < 3; ++step) written.put({step * kStep_ns}, "/odom", kNone, 0);
  ASSERT_TRUE(written.odometry.use("/odom", {MotionTopic{"/odom"}}).ok());
  const auto told = [](const std::string& count) {
    return "/odom: no finite numbers and unit quaternion in " + count + " so far: left out\n";
  };
  EXPECT_EQ(told_by(written.odometry), told("3 poses")) << "of those that came before";
  std::vector<std::string> doubts;
  for (std::int64_t step = 3; step < 120; ++step) {
    written.put({step * kStep_ns}, "/odom", kNone, 0);
    if (auto doubt = told_by(written.odometry); !doubt.empty()) doubts.push_back(doubt);
  }
  EXPECT_EQ(doubts, (std::vector{told("10 poses"), told("100 poses")}));
}

TEST(StreamOdometry, AllThatWasToldBeforeTheTopicWasChosenIsDoubted) {
  WheelsWritten written;
  written.put({0}, "/odom", std::numeric_limits<double>::quiet_NaN(), 0);
  for (std::int64_t step = 1; step < 200; ++step) written.add(step, "/odom", 10);
  ASSERT_TRUE(written.odometry.use("/odom", {MotionTopic{"/odom"}}).ok());
  const std::vector<std::string> doubts = written.odometry.take_doubts();
  ASSERT_EQ(doubts.size(), 2U);
  EXPECT_NE(doubts[0].find("which no robot drives"), std::string::npos) << doubts[0];
  EXPECT_NE(doubts[1].find("in 1 pose so far"), std::string::npos) << doubts[1];
  EXPECT_TRUE(written.odometry.take_doubts().empty()) << "once";
}

TEST(StreamOdometry, OneThreadReadsAnotherTakes) {
  constexpr std::uint32_t kFrames = 300;
  WheelsWritten written;
  ASSERT_TRUE(written.odometry.use("/odom", {MotionTopic{"/odom"}}).ok());
  std::jthread reads([&] {
    for (std::uint32_t k = 0; k < kFrames; ++k) {
      for (std::int64_t i = 0; i < 3; ++i) written.add(3 * std::int64_t{k} + i);
      written.hand_out(k);
    }
  });
  Steps all;
  while (all.size() < std::size_t{3} * kFrames) {
    const Steps some = written.taken(kFrames);
    all.insert(all.end(), some.begin(), some.end());
    std::this_thread::yield();
  }
  for (std::size_t i = 0; i < all.size(); ++i)
    ASSERT_EQ(all[i], static_cast<std::int64_t>(i)) << "in order, each once";
}

}  // namespace
}  // namespace ygslam
