#include "ygslam/ros_adapter.hpp"

#include <gtest/gtest.h>

#include "bag/ros_messages.hpp"
#include "facade/testing/film.hpp"

namespace ygslam::api::testing {
namespace {

constexpr const char* kImage = "sensor_msgs/msg/Image";
constexpr const char* kInfo = "sensor_msgs/msg/CameraInfo";

/// The frames of a film as a camera's driver publishes them: depth in metres.
struct Driver {
  const Film& film;

  [[nodiscard]] Bytes info(double distortion = 0) const {
    ros::CameraInfo info;
    info.width = kWidth, info.height = kHeight;
    const CameraModel& c = film.camera;
    info.k = {c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1};
    info.distortion_model = distortion == 0 ? "plumb_bob" : "equidistant";
    info.d = {distortion, 0, 0, 0};
    return to_cdr(info);
  }
  [[nodiscard]] Bytes image(std::size_t i, bool is_colour) const {
    const Frame frame = film[i];
    ros::Image image;
    image.header.stamp = ros::to_ros(Timestamp{frame.t_ns});
    image.height = kHeight, image.width = kWidth;
    image.encoding = is_colour ? "rgb8" : "32FC1";
    image.step = kWidth * (is_colour ? 3 : 4);
    const auto* pixels =
        is_colour ? frame.rgb : reinterpret_cast<const std::uint8_t*>(frame.depth_m);
    image.data.assign(pixels, pixels + image.step * kHeight);
    return to_cdr(image);
  }
};

int give(RosAdapter& adapter, RosAdapter::Input input, const Bytes& cdr) {
  return adapter.take(input, input == RosAdapter::Input::kCameraInfo ? kInfo : kImage, cdr.data(),
                      cdr.size());
}

struct Listener {
  std::vector<RosMessage> heard;
  [[nodiscard]] RosAdapter::Topics topics() {
    return {{}, [this](RosMessage message) { heard.push_back(std::move(message)); }, 0.5};
  }
  [[nodiscard]] std::vector<RosMessage> of(const std::string& topic) const {
    std::vector<RosMessage> found;
    for (const RosMessage& message : heard)
      if (message.topic == topic) found.push_back(message);
    return found;
  }
};

Settings settings_without_camera() {
  Settings settings;
  settings.segmenter = "none";
  settings.options = {{"orb.features", "500"}};
  settings.deterministic = true;
  return settings;
}

int play(RosAdapter& adapter, const Driver& driver) {
  int frames = 0;
  for (std::size_t i = 0; i < driver.film.size(); ++i) {
    frames += give(adapter, RosAdapter::Input::kDepth, driver.image(i, false));
    frames += give(adapter, RosAdapter::Input::kCameraInfo, driver.info());
    frames += give(adapter, RosAdapter::Input::kColour, driver.image(i, true));
  }
  return frames;
}

TEST(RosAdapter, TellsWhatTheLibraryFindsInTheAxesOfRos) {
  const Driver driver{film("static_xyz")};
  Listener listener;
  RosAdapter adapter(settings_without_camera(), listener.topics());
  // Depth came before the first camera info: the first frame is left out.
  EXPECT_EQ(play(adapter, driver), static_cast<int>(driver.film.size()) - 1);
  adapter.finish();

  Settings settings = settings_without_camera();
  settings.camera = driver.film.camera;
  Slam slam = Slam::open(settings);
  const auto odometry = listener.of("/odometry");
  ASSERT_EQ(odometry.size(), driver.film.size() - 1);
  for (std::size_t i = 1; i < driver.film.size(); ++i) {
    const Result expected = slam.process(driver.film[i]);
    const auto& t = expected.T_odom_camera.translation_m;
    ros::Odometry told;
    ASSERT_TRUE(from_cdr(odometry[i - 1].cdr, told));
    EXPECT_EQ(odometry[i - 1].t_ns, driver.film[i].t_ns);
    EXPECT_EQ(ros::from_ros(told.header.stamp).ns, driver.film[i].t_ns) << "the image's, not now";
    EXPECT_NEAR(told.pose.position.x, t[2], 1e-9);  // forward
    EXPECT_NEAR(told.pose.position.y, -t[0], 1e-9);
    EXPECT_NEAR(told.pose.position.z, -t[1], 1e-9);
    EXPECT_TRUE(i == 1 || told.pose_covariance[0] > 0) << i;
  }
  EXPECT_EQ(odometry.front().type, "nav_msgs/msg/Odometry");
  EXPECT_EQ(listener.of("/tf").size(), driver.film.size() - 1);
  EXPECT_GE(listener.of("/cloud").size(), 3U) << "1.5 s, twice a second, at the end";
  ros::MarkerArray mesh;
  ASSERT_TRUE(from_cdr(listener.of("/mesh").back().cdr, mesh));
  ASSERT_GT(mesh.markers.size(), 1U);
  EXPECT_EQ(mesh.markers[0].action, ros::Marker::kDeleteAll) << "the whole, for late listeners";
  EXPECT_EQ(listener.of("/mesh").size(), listener.of("/cloud").size());
}

TEST(RosAdapter, WhatNobodyWantsIsNotMade) {
  const Driver driver{film("static_xyz")};
  Listener listener;
  RosAdapter::Topics topics = listener.topics();
  topics.wanted = [](const std::string& topic) { return topic == "/tf"; };
  RosAdapter adapter(settings_without_camera(), topics);
  play(adapter, driver);
  EXPECT_EQ(listener.heard.size(), listener.of("/tf").size());
  EXPECT_GT(listener.heard.size(), 0U);
}

TEST(RosAdapter, ResetBeginsANewWorld) {
  const Driver driver{film("static_xyz")};
  Listener listener;
  RosAdapter adapter(settings_without_camera(), listener.topics());
  adapter.reset();  // nothing yet
  give(adapter, RosAdapter::Input::kCameraInfo, driver.info());
  for (const std::size_t i : {0, 1, 2, 3}) {
    if (i == 3) adapter.reset();
    give(adapter, RosAdapter::Input::kDepth, driver.image(i, false));
    give(adapter, RosAdapter::Input::kColour, driver.image(i, true));
  }
  ros::Odometry told;
  ASSERT_TRUE(from_cdr(listener.of("/odometry").back().cdr, told));
  EXPECT_EQ(told.pose.position.x, 0);
  EXPECT_EQ(told.pose_covariance[0], 0);
}

TEST(RosAdapter, AfterTheEndOrMovedFromItSaysSo) {
  const Driver driver{film("static_xyz")};
  Listener listener;
  using Input = RosAdapter::Input;
  RosAdapter first(settings_without_camera(), listener.topics());
  give(first, Input::kCameraInfo, driver.info());
  RosAdapter adapter = std::move(first);
  EXPECT_EQ(code_of([&] { first.finish(); }), 2);  // NOLINT: that is the question
  EXPECT_EQ(code_of([&] { give(first, Input::kDepth, driver.image(0, false)); }), 2);
  give(adapter, Input::kDepth, driver.image(0, false));
  EXPECT_EQ(give(adapter, Input::kColour, driver.image(0, true)), 1);
  adapter.finish();
  const std::size_t heard = listener.heard.size();
  adapter.finish();
  EXPECT_EQ(code_of([&] { give(adapter, Input::kDepth, driver.image(1, false)); }), 2);
  EXPECT_EQ(code_of([&] { adapter.reset(); }), 2);
  EXPECT_EQ(listener.heard.size(), heard);
}

TEST(RosAdapter, WhatCannotBeUsedIsAnError) {
  const Driver driver{film("static_xyz")};
  Listener listener;
  RosAdapter adapter(settings_without_camera(), listener.topics());
  using Input = RosAdapter::Input;
  EXPECT_EQ(code_of([&] { give(adapter, Input::kCameraInfo, driver.info(0.1)); }), 3);
  EXPECT_EQ(code_of([&] { give(adapter, Input::kCameraInfo, {0, 1, 0}); }), 4);
  EXPECT_EQ(give(adapter, Input::kDepth, driver.image(0, false)), 0) << "no camera yet";
  give(adapter, Input::kCameraInfo, driver.info());
  EXPECT_EQ(code_of([&] { give(adapter, Input::kColour, {0, 1, 0, 0, 1}); }), 4);
  EXPECT_EQ(code_of([&] {
              adapter.take(Input::kColour, "std_msgs/msg/String", driver.info().data(), 4);
            }),
            4);
  Bytes cut = driver.image(1, true);
  cut.resize(cut.size() / 2);
  give(adapter, Input::kDepth, driver.image(1, false));
  EXPECT_EQ(code_of([&] { give(adapter, Input::kColour, cut); }), 4);
  give(adapter, Input::kDepth, driver.image(2, false));
  EXPECT_EQ(give(adapter, Input::kColour, driver.image(2, true)), 1) << "and it goes on";
  Settings wrong = settings_without_camera();
  wrong.options["no.such"] = "1";
  EXPECT_EQ(code_of([&] { RosAdapter(wrong, listener.topics()); }), 3);
  wrong = settings_without_camera();
  wrong.segmenter = "frames";
  EXPECT_EQ(code_of([&] { RosAdapter(wrong, listener.topics()); }), 3) << "messages have no masks";
}

}  // namespace
}  // namespace ygslam::api::testing
