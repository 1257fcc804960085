// The ROS 2 node with a stand-in of rclcpp. It shows that the node does what it means to, not that
// it builds or runs with ROS 2.
#include "ros2/src/ygslam_node.cpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "bag/ros_messages.hpp"
#include "core/rng.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam_ros {
namespace {

using ygslam::Bytes;
using ygslam::from_cdr;
using ygslam::to_cdr;
namespace ros = ygslam::ros;

constexpr int kWidth = 320, kHeight = 240;

/// A textured wall two metres away.
Bytes image(std::int64_t t_ns, bool is_colour) {
  ros::Image image;
  image.header.stamp = ros::to_ros(ygslam::Timestamp{t_ns});
  image.width = kWidth, image.height = kHeight;
  image.encoding = is_colour ? "rgb8" : "16UC1";
  image.step = kWidth * (is_colour ? 3 : 2);
  image.data.resize(image.step * kHeight);
  for (int p = 0; p < kWidth * kHeight; ++p) {
    const unsigned cell = (p % kWidth / 12) * 7919U + (p / kWidth / 12) * 104729U;
    auto* at = image.data.data() + p * (is_colour ? 3 : 2);
    if (is_colour) {
      at[0] = at[1] = at[2] = static_cast<std::uint8_t>((cell * 2654435761U) >> 24);
    } else {
      at[0] = 2000 & 255, at[1] = 2000 >> 8;
    }
  }
  return to_cdr(image);
}

Bytes camera_info() {
  ros::CameraInfo info;
  info.width = kWidth, info.height = kHeight;
  info.k = {262.5, 0, 159.5, 0, 262.5, 119.5, 0, 0, 1};
  return to_cdr(info);
}

void send(rclcpp::Node& node, const std::string& topic, const Bytes& bytes) {
  auto message = std::make_shared<rclcpp::SerializedMessage>(bytes.size());
  auto& raw = message->get_rcl_serialized_message();
  std::copy(bytes.begin(), bytes.end(), raw.buffer);
  raw.buffer_length = bytes.size();
  node.subscriptions.at(topic)->callback(message);
}

TEST(RosNode, ImagesInOdometryOut) {
  const ygslam::testing::TempFolder folder("ygslam-node");
  const std::string map_file = folder.path() / "room.map";
  YgslamNode node({{{"map_file", map_file}}});
  node.publishers.at("~/odometry")->listeners = 1;
  node.publishers.at("~/cloud")->listeners = 1;
  send(node, "rgb/camera_info", camera_info());
  for (int i = 0; i < 5; ++i) {
    send(node, "depth/image", image(i * 33'000'000LL + 1, false));
    send(node, "rgb/image", image(i * 33'000'000LL + 1, true));
  }
  send(node, "rgb/image", {0, 1, 0, 0});  // told and left out
  EXPECT_EQ(node.publishers.at("/tf")->sent.size(), 5U);
  EXPECT_EQ(node.publishers.at("~/cloud")->sent.size(), 1U);
  EXPECT_TRUE(node.publishers.at("~/cloud")->qos.is_transient_local);
  EXPECT_TRUE(node.publishers.at("~/state")->sent.empty()) << "nobody listens";
  const auto& sent = node.publishers.at("~/odometry")->sent;
  ASSERT_EQ(sent.size(), 5U);
  ros::Odometry told;
  ASSERT_TRUE(from_cdr(sent.back(), told));
  EXPECT_EQ(ros::from_ros(told.header.stamp).ns, 4 * 33'000'000LL + 1);
  EXPECT_NEAR(told.pose.position.x, 0, 0.01);

  std::string said;
  EXPECT_TRUE(node.services.at("~/save_map")(said)) << said;
  EXPECT_TRUE(std::filesystem::exists(map_file));
  EXPECT_TRUE(node.services.at("~/reset")(said));
  YgslamNode nowhere({{{"map_file", folder.path() / "none" / "room.map"}}});
  send(nowhere, "rgb/camera_info", camera_info());
  EXPECT_FALSE(nowhere.services.at("~/save_map")(said));
  EXPECT_NE(said.find("room.map"), std::string::npos);
}

TEST(RosNode, ACameraThatCannotBeUsedEndsIt) {
  YgslamNode node({});
  EXPECT_THROW(send(node, "rgb/camera_info", to_cdr(ros::CameraInfo())), ygslam::api::Error);
}

}  // namespace
}  // namespace ygslam_ros
