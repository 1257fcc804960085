#include "bag/bag_trajectory.hpp"

#include <gtest/gtest.h>

#include "bag/ros_messages.hpp"

namespace ygslam {
namespace {

using ros::to_ros;

class BagTrajectory : public ::testing::Test {
 protected:
  template <typename Message>
  void say(const std::string& name, const std::string& type, const Message& message) {
    const BagTopic topic{name, type, Layout::kCdr};
    const Bytes bytes = to_cdr(message);
    reader_.take(topic, {0, {99}, bytes, {}});
  }
  static ros::Header at(int second, const std::string& frame = "world") {
    return {{second, 500}, frame};
  }
  static ros::Pose pose(double x) {
    return to_ros(SE3(Eigen::Quaterniond::Identity(), Vec3(x, 2, 3)));
  }

  void expect_taken(const std::string& choice, const std::string& words) {
    const auto file = chosen_trajectory(reader_.sources(), choice, "--gt-topic");
    ASSERT_TRUE(file.ok()) << file.error().message;
    ASSERT_EQ(file->poses.size(), 2U);
    EXPECT_EQ(file->poses[0].stamp.ns, 1'000'000'500);
    EXPECT_EQ(file->poses[1].T_world_camera.t(), Vec3(2, 2, 3));
    EXPECT_NE(file->taken_for.find(words), std::string::npos) << file->taken_for;
  }
  std::string refusal(const std::string& choice) {
    const auto file = chosen_trajectory(reader_.sources(), choice, "--gt-topic");
    return file.ok() ? "accepted" : file.error().message;
  }

  void say_odometry(const std::string& name) {
    for (const int i : {2, 1, 2})
      say(name, "nav_msgs/Odometry", ros::Odometry{at(i), "base", pose(i), {}, {}, {}});
  }
  PoseReader reader_;
};

TEST_F(BagTrajectory, OdometryIsTakenInOrderOfTime) {
  say_odometry("/odom");
  expect_taken("", "2 poses of /odom (nav_msgs/Odometry)");
}

TEST_F(BagTrajectory, PosesWithAndWithoutCovarianceAndTransforms) {
  struct WithCovariance {
    ros::PoseStamped stamped;
    std::array<double, 36> covariance{};
    static void fields(const WithCovariance& m, CdrWriter& cdr) { cdr(m.stamped, m.covariance); }
  };
  for (const int i : {1, 2}) {
    say("/a", "geometry_msgs/PoseStamped", ros::PoseStamped{at(i), pose(i)});
    say("/b", "geometry_msgs/PoseWithCovarianceStamped", WithCovariance{{at(i), pose(i)}, {}});
    say("/vicon", "geometry_msgs/TransformStamped", ros::TransformStamped{at(i), "rig", pose(i)});
  }
  expect_taken("/a", "/a (geometry_msgs/PoseStamped)");
  expect_taken("/b", "PoseWithCovarianceStamped");
  expect_taken("/vicon", "TransformStamped");
  EXPECT_NE(refusal("").find("several topics have poses: /a (geometry_msgs/PoseStamped, 2 poses), "
                             "/b"),
            std::string::npos);
  EXPECT_NE(refusal("").find("choose with --gt-topic"), std::string::npos);
  EXPECT_NE(refusal("/c").find("no poses under --gt-topic /c; there are /a"), std::string::npos);
}

TEST_F(BagTrajectory, OfAPathTheLastMessageCounts) {
  ros::Path path{at(9), {{at(1), pose(7)}}};
  say("/path", "nav_msgs/Path", path);
  path.poses = {{at(1), pose(1)}, {at(2), pose(2)}};
  say("/path", "nav_msgs/Path", path);
  expect_taken("", "/path (nav_msgs/Path)");
}

TEST_F(BagTrajectory, OfTransformsAFrameIsChosen) {
  for (const int i : {1, 2})
    say("/tf", "tf2_msgs/TFMessage",
        ros::TfMessage{{{at(i), "camera", pose(i)}, {at(i, "camera"), "lens", pose(9)}}});
  say("/tf_static", "tf2_msgs/TFMessage", ros::TfMessage{{{at(1), "fixed", pose(1)}}});
  expect_taken("/tf:camera", "/tf:camera (tf2_msgs/TFMessage)");
  EXPECT_NE(refusal("").find("/tf:lens"), std::string::npos);
  EXPECT_EQ(refusal("").find("fixed"), std::string::npos);
  say_odometry("/odom");
  expect_taken("", "/odom");
}

TEST_F(BagTrajectory, WhatIsNoPoseIsLeftOutAndCounted) {
  EXPECT_NE(refusal("").find("no topic with poses"), std::string::npos);
  say_odometry("/odom");
  ros::Pose empty;
  empty.orientation.w = 0;
  say("/odom", "nav_msgs/Odometry", ros::Odometry{at(3), "base", empty, {}, {}, {}});
  expect_taken("", "2 left out: doubled or no unit quaternion");
}

}  // namespace
}  // namespace ygslam
