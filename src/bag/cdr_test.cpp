#include "bag/cdr.hpp"

#include <gtest/gtest.h>

#include "bag/ros_messages.hpp"

namespace ygslam {
namespace {

ros::Header some_header() { return {{7, 123}, "map"}; }

TEST(Cdr, NumbersAreAlignedToTheirSizeAfterTheHead) {
  const ros::Header header = some_header();
  EXPECT_EQ(to_cdr(header), (Bytes{0, 1, 0, 0,                       // head
                                   7, 0, 0, 0, 123, 0,   0,   0,     // stamp
                                   4, 0, 0, 0, 'm', 'a', 'p', 0}));  // frame_id
  ros::PoseStamped pose{header, {}};
  pose.pose.position.x = 1;
  const Bytes bytes = to_cdr(pose);
  ASSERT_EQ(bytes.size(), 4U + 16 + 7 * 8);
  EXPECT_EQ(bytes[4 + 16 + 7], 0x3F) << "of 1.0, 8-aligned without a gap here";
  const ros::TransformStamped odd{{{1, 2}, "odom"}, "x", {}};
  EXPECT_EQ(to_cdr(odd).size(), 4U + 8 + 9 + 3 + 6 + 6 + 7 * 8) << "gaps before 4 and 8 bytes";
}

TEST(Cdr, WhatWasWrittenIsRead) {
  ros::CameraInfo info;
  info.header = some_header();
  info.width = 640;
  info.d = {0.1, -0.2, 0.3};
  info.k[4] = 525;
  info.roi_do_rectify = 1;
  ros::CameraInfo read;
  ASSERT_TRUE(from_cdr(to_cdr(info), read));
  EXPECT_EQ(to_cdr(read), to_cdr(info));
  EXPECT_EQ(read.d, info.d);
  EXPECT_EQ(read.header.frame_id, "map");
  ros::Path path{some_header(), {{some_header(), {}}, {{{1, 2}, "odom"}, {}}}};
  path.poses[1].pose.orientation.z = 0.5;
  ros::Path read_path;
  ASSERT_TRUE(from_cdr(to_cdr(path), read_path));
  EXPECT_EQ(to_cdr(read_path), to_cdr(path));
  EXPECT_EQ(read_path.poses.at(1).pose.orientation.z, 0.5);
}

TEST(Cdr, BigEndianIsReadToo) {
  const Bytes bytes = {0, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0, 123, 0, 0, 0, 4, 'm', 'a', 'p', 0};
  ros::Header header;
  ASSERT_TRUE(from_cdr(bytes, header));
  EXPECT_EQ(to_cdr(header), to_cdr(some_header()));
}

TEST(Cdr, BytesThatEndEarlyOrPromiseTooMuchAreRefused) {
  ros::Image image{some_header(), 2, 2, "mono8", 0, 2, {1, 2, 3, 4}};
  const Bytes whole = to_cdr(image);
  for (std::size_t n = 0; n < whole.size(); ++n) {
    ros::Image read;
    EXPECT_FALSE(from_cdr(std::span(whole).first(n), read)) << n;
  }
  Bytes liar = whole;
  const std::uint32_t many = 0xffffffff;
  std::memcpy(liar.data() + liar.size() - 8, &many, sizeof many);
  ros::Image read;
  EXPECT_FALSE(from_cdr(liar, read));
  EXPECT_TRUE(read.data.empty());
}

TEST(RosMessages, TimesKeepTheirNanoseconds) {
  for (const std::int64_t ns : {0LL, 1LL, 1'311'868'164'363'181'001LL, -1LL})
    EXPECT_EQ(ros::from_ros(ros::to_ros(Timestamp{ns})).ns, ns);
}

TEST(RosMessages, ASchemaDefinesAllItIsMadeOfOnce) {
  const std::string schema = ros::schema_of(ros::MarkerArray::kType);
  EXPECT_EQ(schema.rfind("visualization_msgs/Marker[] markers\n", 0), 0U);
  for (const char* part :
       {"visualization_msgs/Marker", "std_msgs/Header", "builtin_interfaces/Time",
        "sensor_msgs/CompressedImage", "geometry_msgs/Point"}) {
    const std::string head = "MSG: " + std::string(part) + "\n";
    EXPECT_NE(schema.find(head), std::string::npos) << part;
    EXPECT_EQ(schema.find(head), schema.rfind(head)) << part;
  }
}

}  // namespace
}  // namespace ygslam
