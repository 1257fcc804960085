#include "bag/stream_sequence.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>

#include "bag/imu_messages.hpp"
#include "bag/mcap_writer.hpp"
#include "io/frame_stream.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

constexpr int kSide_px = 256;  // three pairs are a chunk, which is read at once
constexpr std::int64_t kSecond_ns = 1'000'000'000, kOfFrame_ns = 50'000'000;
constexpr int kPairs = 20;

ros::Image image_of(std::int64_t t_ns, const std::string& encoding, int bytes) {
  ros::Image image;
  image.header = {ros::to_ros(Timestamp{t_ns}), "camera"};
  image.height = image.width = kSide_px;
  image.encoding = encoding;
  image.step = static_cast<std::uint32_t>(bytes * kSide_px);
  image.data.assign(static_cast<std::size_t>(bytes) * kSide_px * kSide_px, 4);
  return image;
}

/// A second of a robot's camera with an IMU in halves and wheels, all placed by /tf_static.
class StreamWithMotion : public ::testing::Test {
 protected:
  template <typename Message>
  void say(const std::string& topic, std::int64_t t_ns, const Message& message) {
    ASSERT_TRUE(writer_->write(topic, Message::kType, {t_ns}, to_cdr(message)).ok());
  }
  void place(const std::string& frame, double x_m) {
    ros::TransformStamped transform;
    transform.header.frame_id = "camera";
    transform.child_frame_id = frame;
    transform.transform.position.x = x_m;
    say("/tf_static", kSecond_ns, ros::TfMessage{{transform}});
  }
  void say_pair(std::int64_t t_ns) {
    ros::CameraInfo info;
    info.header.frame_id = "camera";
    info.height = info.width = kSide_px;
    info.distortion_model = "plumb_bob";
    info.k = {240, 0, 128, 0, 240, 128, 0, 0, 1};
    say("/rgb/camera_info", t_ns, info);
    say("/rgb/image", t_ns, image_of(t_ns, "rgb8", 3));
    say("/depth/image", t_ns, image_of(t_ns, "16UC1", 2));
  }
  void say_motion(std::int64_t t_ns, bool accel) {
    const Timestamp stamp{t_ns};
    const Vec3 force(0, 1e-9 * static_cast<double>(t_ns), 9.8);
    say("/gyro", t_ns, ros::to_ros({stamp, Vec3::UnitX(), Vec3::Zero()}, {}, "gyro_frame"));
    if (accel) say("/accel", t_ns, ros::to_ros({stamp, Vec3::Zero(), force}, {}, "gyro_frame"));
    ros::Odometry odometry;
    odometry.header = {ros::to_ros(stamp), "odom"};
    odometry.child_frame_id = "base";
    say("/wheels", t_ns, odometry);
  }
  /// @param places_after so many pairs. Motion is told from then on.
  Result<Sequence> stream(const WantedMotion& wanted, int places_after = 0) {
    auto created = McapWriter::create(folder_.path() / "s.mcap");
    writer_.emplace(std::move(created).value());
    for (int pair = 0; pair < kPairs; ++pair) {
      const std::int64_t t_ns = kSecond_ns + pair * kOfFrame_ns;
      if (pair == places_after) {
        place("gyro_frame", 0.1);
        place("base", -0.5);
      }
      say_pair(t_ns);
      for (std::int64_t i = 0; i < 10 && pair >= places_after; ++i)
        say_motion(t_ns + i * kOfFrame_ns / 10, i % 3 == 0);
    }
    EXPECT_TRUE(writer_->finish().ok());
    const int file = ::open((folder_.path() / "s.mcap").c_str(), O_RDONLY | O_CLOEXEC);
    return open_stream_sequence(ByteStream(file, "stream", {}), {}, {}, wanted);
  }
  testing::TempFolder folder_;
  std::optional<McapWriter> writer_;
};

WantedMotion both() { return {{true, true}, {true, true}}; }

TEST_F(StreamWithMotion, ItsReadingsComeWithTheFramesAndItsSensorsArePlaced) {
  for (const int late : {0, 12}) {  // more pairs than are needed without motion
    auto sequence = stream(both(), late);
    ASSERT_TRUE(sequence.ok()) << sequence.error().message;
    ASSERT_EQ(sequence->imu_topics.size(), 2U);
    ASSERT_TRUE(sequence->imu_topics[0].T_frame_camera);
    EXPECT_EQ(sequence->imu_topics[0].T_frame_camera->t().x(), -0.1);
    ASSERT_EQ(sequence->odometry_topics.size(), 1U);
    EXPECT_EQ(sequence->odometry_topics[0].T_frame_camera->t().x(), 0.5);
    FrameStream& frames = *sequence->stream;
    const auto imu = frames.use_imu("");
    ASSERT_TRUE(imu.ok()) << imu.error().message;
    EXPECT_EQ(*imu, "/gyro");
    EXPECT_EQ(*frames.use_odometry(""), "/wheels");
    std::size_t readings = 0, poses = 0, pairs = 0;
    for (std::uint32_t id = 0; frames.next(FrameId{id}, {}, {}); ++id, ++pairs) {
      const StreamMotion motion = frames.take_motion(FrameId{id});
      readings += motion.imu.size();
      poses += motion.wheels.size();
      for (const ImuSample& sample : motion.imu)
        EXPECT_NEAR(sample.specific_force_mps2.y(), 1e-9 * static_cast<double>(sample.stamp.ns),
                    1e-9);
    }
    EXPECT_EQ(pairs, static_cast<std::size_t>(kPairs)) << "none is lost";
    const std::size_t said = 10 * static_cast<std::size_t>(kPairs - 1 - late);
    EXPECT_GE(poses, said);
    EXPECT_GE(readings, said);
    EXPECT_LE(poses, said + 10);
  }
}

TEST_F(StreamWithMotion, WhatIsNotWantedIsNotAwaited) {
  auto sequence = stream({}, 12);
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  EXPECT_TRUE(sequence->imu_topics.empty());
  EXPECT_FALSE(sequence->stream->use_imu("/gyro").ok());
  EXPECT_FALSE(sequence->stream->use_odometry("/wheels").ok());
}

TEST_F(StreamWithMotion, WhatNeverComesIsNotAwaitedForEver) {
  auto sequence = stream(both(), kPairs + 1);
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  std::uint32_t id = 0;
  while (sequence->stream->next(FrameId{id}, {}, {})) ++id;
  EXPECT_EQ(id, static_cast<std::uint32_t>(kPairs));
}

}  // namespace
}  // namespace ygslam
