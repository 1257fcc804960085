#include "bag/bag_imu.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <memory>

#include "bag/imu_messages.hpp"
#include "bag/mcap_writer.hpp"
#include "core/log.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

constexpr const char* kImuType = "sensor_msgs/Imu";

ImuSample reading(std::int64_t ms, const Vec3& gyro, const Vec3& accel) {
  return {{ms * 1'000'000}, gyro, accel};
}

class BagImu : public ::testing::Test {
 protected:
  void say(const std::string& name, const ImuSample& sample) {
    const BagTopic topic{name, kImuType, Layout::kCdr};
    const Bytes bytes = to_cdr(ros::to_ros(sample, {}, "imu"));
    reader_.take(topic, {0, {99}, bytes, {}});
  }
  std::string refusal(const std::string& choice = "") {
    const auto samples = chosen_readings(reader_.sources(), choice, "--imu-topic");
    return samples.ok() ? "accepted" : samples.error().message;
  }
  using Lines = std::vector<std::string>;
  ImuReader reader_;
  Lines told_;  // warnings
  log::ScopedSink sink_{
      std::make_shared<const log::Sink>([this](log::Level level, const std::string& line) {
        if (level == log::Level::kWarning) told_.push_back(line);
      })};
};

TEST_F(BagImu, ReadingsAreTakenInOrderOfTime) {
  for (const std::int64_t ms : {10, 5, 10, 15})
    say("/imu", reading(ms, Vec3(0.1, 0.2, 0.001 * static_cast<double>(ms)), Vec3(0, 0.5, 9.7)));
  const auto samples = chosen_readings(reader_.sources(), "", "--imu-topic");
  ASSERT_TRUE(samples.ok()) << samples.error().message;
  EXPECT_EQ(told_, (Lines{"/imu: stamps go back; readings are sorted by their stamps",
                          "/imu: 1 reading with the stamp of another: left out"}));
  ASSERT_EQ(samples->samples.size(), 3U);
  EXPECT_EQ(samples->samples[0].stamp.ns, 5'000'000);
  EXPECT_EQ(samples->samples[1].angular_velocity_radps, Vec3(0.1, 0.2, 0.01));
  EXPECT_EQ(samples->samples[2].specific_force_mps2, Vec3(0, 0.5, 9.7));
}

TEST_F(BagImu, HalvesOfARealSenseAreUnited) {
  for (std::int64_t ms = 102; ms < 160; ms += 5)
    say("/camera/gyro/sample",
        reading(ms, Vec3(0.01 * static_cast<double>(ms), 0, 0), Vec3::Zero()));
  for (std::int64_t ms = 100; ms <= 148; ms += 16)
    say("/camera/accel/sample",
        reading(ms, Vec3::Zero(), Vec3(0.01 * static_cast<double>(ms), 0, 9.8)));
  const auto samples = chosen_readings(reader_.sources(), "", "--imu-topic");
  ASSERT_TRUE(samples.ok()) << samples.error().message;
  ASSERT_EQ(samples->samples.size(), 10U);  // none behind the last acceleration
  for (const ImuSample& sample : samples->samples) {
    const double expected = 0.01 * static_cast<double>(sample.stamp.ns) * 1e-6;
    EXPECT_NEAR(sample.specific_force_mps2.x(), expected, 1e-12);
    EXPECT_NEAR(sample.angular_velocity_radps.x(), expected, 1e-12);
    EXPECT_NEAR(sample.specific_force_mps2.z(), 9.8, 1e-12);
  }
}

TEST_F(BagImu, OneHalfTakesItsOtherAlong) {
  const auto say_half = [&](const std::string& name, bool is_gyro) {
    for (const std::int64_t ms : {10, 20, 30})
      say(name, is_gyro ? reading(ms, Vec3(0.1, 0.2, 0), Vec3::Zero())
                        : reading(ms, Vec3::Zero(), Vec3(0, 0.5, 9.8)));
  };
  for (const std::string camera : {"/left/", "/right/"}) {
    say_half(camera + "gyro/sample", true);
    say_half(camera + "accel/sample", false);
  }
  EXPECT_NE(refusal().find("several topics"), std::string::npos) << "of two cameras";
  for (const std::string half : {"gyro", "accel"}) {
    const auto samples = chosen_readings(reader_.sources(), "/right/" + half + "/sample", "--imu");
    ASSERT_TRUE(samples.ok()) << samples.error().message;
    EXPECT_EQ(samples->topics.gyro, "/right/gyro/sample");
    EXPECT_EQ(samples->topics.accel, "/right/accel/sample");
    EXPECT_EQ(samples->samples.size(), 3U);
  }
  say_half("/third/accel", false);
  EXPECT_NE(refusal("/third/accel").find("/third/accel: an accelerometer alone"), std::string::npos)
      << "whose gyroscope is of neither";
}

TEST_F(BagImu, TheOnlyTwoHalvesMayHaveAnyNames) {
  say("/turns", reading(10, Vec3(0.1, 0.2, 0), Vec3::Zero()));
  say("/robot/force", reading(10, Vec3::Zero(), Vec3(0, 0.5, 9.8)));
  say("/imu", reading(10, Vec3(0.1, 0.2, 0), Vec3(0, 0.5, 9.8)));
  for (const std::string half : {"/turns", "/robot/force"}) {
    const auto topics = choose_imu(reader_.sources(), half, "--imu");
    ASSERT_TRUE(topics.ok()) << topics.error().message;
    EXPECT_EQ(topics->gyro, "/turns");
    EXPECT_EQ(topics->accel, "/robot/force");
  }
  EXPECT_FALSE(choose_imu(reader_.sources(), "/imu", "--imu")->are_halves());
}

TEST_F(BagImu, AHalfMayBeMissingByItsCovariance) {
  const auto say_half = [&](const std::string& name, std::int64_t ms, bool gyro_there) {
    ros::Imu imu = ros::to_ros(reading(ms, Vec3(0.1, 0, 0), Vec3(0, 0, 9.8)), {}, "imu");
    ros::Vector3& none = gyro_there ? imu.linear_acceleration : imu.angular_velocity;
    none.x = std::numeric_limits<double>::quiet_NaN();
    (gyro_there ? imu.linear_acceleration_covariance : imu.angular_velocity_covariance)[0] = -1;
    reader_.take({name, kImuType, Layout::kCdr}, {0, {99}, to_cdr(imu), {}});
  };
  for (const std::int64_t ms : {10, 20, 30}) {
    say_half("/gyro", ms, true);
    say_half("/accel", ms, false);
  }
  const auto samples = chosen_readings(reader_.sources(), "", "--imu-topic");
  ASSERT_TRUE(samples.ok()) << samples.error().message;
  EXPECT_EQ(samples->topics.gyro, "/gyro");
  EXPECT_EQ(samples->topics.accel, "/accel");
  ASSERT_EQ(samples->samples.size(), 3U);
  EXPECT_EQ(samples->samples[1].specific_force_mps2, Vec3(0, 0, 9.8));
}

TEST_F(BagImu, CovariancesThatAreNotKnownTakeNothingAway) {
  ros::Imu imu = ros::to_ros(reading(1, Vec3(0.1, 0, 0), Vec3(0, 0, 9.8)), {}, "imu");
  imu.linear_acceleration_covariance[0] = imu.angular_velocity_covariance[0] = -1;
  reader_.take({"/imu", kImuType, Layout::kCdr}, {0, {99}, to_cdr(imu), {}});
  EXPECT_EQ(refusal(), "accepted");
}

TEST_F(BagImu, WhatCannotBeChosenIsTold) {
  EXPECT_EQ(refusal(), "no topic with inertial readings (sensor_msgs/Imu)");
  say("/a", reading(1, Vec3::UnitX(), Vec3(0, 0, 9.8)));
  EXPECT_NE(refusal("/c").find("no readings under --imu-topic /c; there are /a (1 readings)"),
            std::string::npos);
  say("/b", reading(1, Vec3::UnitX(), Vec3(0, 0, 9.8)));
  EXPECT_NE(refusal().find("several topics have inertial readings: /a (1 readings), /b"),
            std::string::npos);
  EXPECT_EQ(refusal("/a"), "accepted");
}

TEST_F(BagImu, NumbersThatAreNoneAreLeftOutAndOtherUnitsRefused) {
  say("/imu", reading(1, Vec3::UnitX(), Vec3(0, 0, std::numeric_limits<double>::quiet_NaN())));
  EXPECT_NE(refusal().find("/imu: no readings in it"), std::string::npos);
  say("/imu", reading(2, Vec3::UnitX(), Vec3(0, 0, 1)));
  EXPECT_NE(refusal().find("units of g"), std::string::npos) << refusal();
}

TEST_F(BagImu, MessagesThatAreCutAreATopicAllTheSame) {
  const Bytes whole = to_cdr(ros::to_ros(reading(1, Vec3::UnitX(), Vec3(0, 0, 9.8)), {}, "imu"));
  reader_.take({"/imu", kImuType, Layout::kCdr}, {0, {99}, std::span(whole).first(20), {}});
  EXPECT_EQ(refusal(), "/imu: no readings in it");
  EXPECT_EQ(told_, Lines{"/imu: 1 reading that cannot be used: left out"});
}

TEST_F(BagImu, OneReadingASecondIsRefused) {
  for (const std::int64_t ms : {1000, 2000, 3000})
    say("/imu", reading(ms, Vec3(0.1, 0.2, 0.3), Vec3(0, 0.5, 9.7)));
  EXPECT_EQ(refusal(), "/imu: readings are 1 s apart, which no inertial sensor's are");
}

TEST_F(BagImu, IsReadFromARecording) {
  const testing::TempFolder folder;
  auto writer = McapWriter::create(folder.path() / "a.mcap");
  ASSERT_TRUE(writer.ok());
  const ImuSample sample = reading(1'000'000, Vec3(0.1, -0.2, 0.3), Vec3(1, 2, 9.5));
  ASSERT_TRUE(
      writer->write("/imu", ros::Imu::kType, sample.stamp, to_cdr(ros::to_ros(sample, {}, "imu")))
          .ok());
  ASSERT_TRUE(writer->finish().ok());
  const auto samples = read_bag_imu(folder.path() / "a.mcap", "", "--imu-topic");
  ASSERT_TRUE(samples.ok()) << samples.error().message;
  ASSERT_EQ(samples->samples.size(), 1U);
  EXPECT_EQ(samples->samples.front().stamp, sample.stamp);
  EXPECT_EQ(samples->samples.front().angular_velocity_radps, sample.angular_velocity_radps);
  EXPECT_EQ(samples->samples.front().specific_force_mps2, sample.specific_force_mps2);
  const auto none = read_bag_imu(folder.path() / "b.mcap", "", "--imu-topic");
  EXPECT_FALSE(none.ok());
}

}  // namespace
}  // namespace ygslam
