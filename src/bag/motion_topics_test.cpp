#include "bag/motion_topics.hpp"

#include <gtest/gtest.h>

#include "bag/imu_messages.hpp"

namespace ygslam {
namespace {

const BagTopic kImu{"/imu", "sensor_msgs/Imu", Layout::kCdr};
const BagTopic kOdom{"/odom", "nav_msgs/Odometry", Layout::kCdr};
const BagTopic kWheelOdom{"/wheel_odom", "nav_msgs/Odometry", Layout::kCdr};
const BagTopic kSilent{"/later", "sensor_msgs/Imu", Layout::kCdr};
const BagTopic kTree{"/tf_static", "tf2_msgs/TFMessage", Layout::kCdr};

class MotionTopicsTest : public ::testing::Test {
 protected:
  void say(const BagTopic& topic, const Bytes& bytes) { sensors_.take(topic, {0, {1}, bytes, {}}); }
  void say_imu(const std::string& frame) {
    ros::Imu imu;
    imu.header.frame_id = frame;
    say(kImu, to_cdr(imu));
  }
  void place(const std::string& parent, const std::string& child, double x_m) {
    ros::TransformStamped transform;
    transform.header.frame_id = parent;
    transform.child_frame_id = child;
    transform.transform.position.x = x_m;
    tree_.take(kTree, to_cdr(ros::TfMessage{{transform}}));
  }
  Sequence listed(const std::string& camera_frame = "camera") {
    Sequence sequence;
    sensors_.list({kOdom, kImu, kSilent, kWheelOdom, kImu}, tree_, camera_frame, sequence);
    return sequence;
  }
  MotionFrames sensors_;
  FrameTree tree_;
};

TEST_F(MotionTopicsTest, AreListedWithThePlacesOfTheirSensors) {
  say_imu("/imu_link");
  ros::Odometry odometry;
  odometry.header.frame_id = "odom";
  odometry.child_frame_id = "base";
  say(kWheelOdom, to_cdr(odometry));
  place("base", "camera", 0.5);
  place("camera", "imu_link", 0.1);
  const Sequence sequence = listed();
  ASSERT_EQ(sequence.imu_topics.size(), 2U);
  EXPECT_EQ(sequence.imu_topics[0].name, "/imu");
  ASSERT_TRUE(sequence.imu_topics[0].T_frame_camera);
  EXPECT_EQ(sequence.imu_topics[0].T_frame_camera->t().x(), -0.1);
  EXPECT_FALSE(sequence.imu_topics[1].T_frame_camera);
  EXPECT_EQ(sequence.imu_topics[1].missing, "no message of /later or of the images names a frame");
  ASSERT_EQ(sequence.odometry_topics.size(), 2U);
  EXPECT_EQ(sequence.odometry_topics[0].name, "/wheel_odom") << "named after wheels";
  ASSERT_TRUE(sequence.odometry_topics[0].T_frame_camera);
  EXPECT_EQ(sequence.odometry_topics[0].T_frame_camera->t().x(), 0.5);
}

TEST_F(MotionTopicsTest, WithoutATransformTheFramesAreNamed) {
  say_imu("imu_link");
  say_imu("camera");  // the first counts
  say_imu("imu_link");
  EXPECT_EQ(listed().imu_topics[0].changed,
            "a later message is of the frame 'camera', the first of 'imu_link'");
  EXPECT_EQ(sensors_.take_change("/odom"), "");
  EXPECT_NE(sensors_.take_change("/imu"), "");
  EXPECT_EQ(sensors_.take_change("/imu"), "") << "once";
  say_imu("camera");
  EXPECT_EQ(sensors_.take_change("/imu"), "");
  EXPECT_EQ(listed().imu_topics[0].missing,
            "of the frames 'imu_link' and 'camera' there is no transform between them on "
            "/tf_static");
}

TEST_F(MotionTopicsTest, PlacesInOtherUnitsAreNone) {
  say_imu("imu_link");
  place("camera", "imu_link", 1e5);
  const MotionTopic imu = listed().imu_topics[0];
  EXPECT_FALSE(imu.T_frame_camera);
  EXPECT_EQ(imu.missing,
            "of the frames 'imu_link' and 'camera' one is farther than 100 m from the other "
            "(metres are expected)");
}

// As of a rendered recording's truth, or of visual odometry.
TEST_F(MotionTopicsTest, OdometryOfTheCameraItselfIsOfNoWheels) {
  const auto say_moving = [&](const BagTopic& topic, const std::string& frame) {
    ros::Odometry odometry;
    odometry.header.frame_id = "odom";
    odometry.child_frame_id = frame;
    say(topic, to_cdr(odometry));
  };
  say_moving(kOdom, "device");
  say_moving(kWheelOdom, "base");
  ros::TransformStamped lens;
  lens.header.frame_id = "device";
  lens.child_frame_id = "camera";
  lens.transform.position.x = 0.015;
  tree_.take({"/tf", "tf2_msgs/TFMessage", Layout::kCdr}, to_cdr(ros::TfMessage{{lens}}));
  place("base", "device", 0.3);
  const Sequence sequence = listed();
  ASSERT_EQ(sequence.odometry_topics.size(), 2U);
  EXPECT_FALSE(sequence.odometry_topics[0].is_camera) << "0.3 m from it";
  EXPECT_EQ(sequence.odometry_topics[1].name, "/odom");
  EXPECT_TRUE(sequence.odometry_topics[1].is_camera);
  EXPECT_FALSE(listed("nobody").odometry_topics[1].is_camera);
}

// As visual odometry of a RealSense D455: camera_link is 6 cm beside the colour camera.
TEST_F(MotionTopicsTest, OdometryOfTheCamerasDeviceIsOfNoWheels) {
  const auto is_camera = [&](const std::string& frame, double from_camera_m) {
    sensors_ = {};
    tree_ = {};
    ros::Odometry odometry;
    odometry.child_frame_id = frame;
    say(kOdom, to_cdr(odometry));
    place(frame, "camera", from_camera_m);
    return listed().odometry_topics[1].is_camera;
  };
  EXPECT_TRUE(is_camera("camera_link", 0.059));
  EXPECT_FALSE(is_camera("camera_link", 0.15));
  EXPECT_FALSE(is_camera("robot/base_link", 0.059)) << "of a small robot";
  EXPECT_FALSE(is_camera("base_footprint", 0.059));
}

// Odometry on /tf alone, as a robot has it that publishes no nav_msgs/Odometry.
TEST_F(MotionTopicsTest, FramesThatTfMovesAreListedWithTheirPlaces) {
  const BagTopic tf{"/tf", "tf2_msgs/TFMessage", Layout::kCdr};
  ros::TransformStamped base, person;
  base.header.frame_id = "odom";
  base.child_frame_id = "/base";
  person.header.frame_id = "map";
  person.child_frame_id = "person";
  const Bytes bytes = to_cdr(ros::TfMessage{{base, person}});
  for (int i = 0; i < 2; ++i) {
    say(tf, bytes);
    tree_.take(tf, bytes);
  }
  EXPECT_TRUE(sensors_.knows("/tf:base"));
  EXPECT_FALSE(sensors_.is_placed("/tf:base", tree_, "camera"));
  place("base", "camera", 0.5);
  EXPECT_TRUE(sensors_.is_placed("/tf:base", tree_, "camera"));
  say(kTree, to_cdr(ros::TfMessage{{base}}));
  const Sequence sequence = listed();
  ASSERT_EQ(sequence.moving_frames.size(), 2U);
  EXPECT_EQ(sequence.moving_frames[0].name, "/tf:base");
  ASSERT_TRUE(sequence.moving_frames[0].T_frame_camera);
  EXPECT_EQ(sequence.moving_frames[0].T_frame_camera->t().x(), 0.5);
  EXPECT_EQ(sequence.moving_frames[1].missing,
            "of the frames 'person' and 'camera' there is no transform between them on /tf_static");
}

TEST_F(MotionTopicsTest, FramesWithoutNamesAreNotOne) {
  say_imu("");
  EXPECT_FALSE(listed("").imu_topics[0].T_frame_camera);
}

}  // namespace
}  // namespace ygslam
