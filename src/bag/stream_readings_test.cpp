#include "bag/stream_readings.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <thread>

#include "bag/imu_messages.hpp"

namespace ygslam {
namespace {

constexpr std::int64_t kOneMs_ns = 1'000'000;
constexpr std::size_t kMost = FrameShares<ImuSample>::kMostWaiting;
const Vec3 kTurning(0.1, 0.2, 0.3), kGravity(0, 0.5, 9.7);

/// A header without a stamp: that of the recording counts, which may be any.
Bytes unstamped(const Vec3& gyro, const Vec3& accel) {
  return to_cdr(ros::to_ros({{0}, gyro, accel}, {}, "imu"));
}

/// Its stamps count milliseconds.
struct Written {
  StreamReadings readings;
  Bytes usual = unstamped(kTurning, kGravity);

  void add(std::int64_t ms, const std::string& topic = "/imu") { add_of(ms, usual, topic); }
  void add_of(std::int64_t ms, const Bytes& bytes, const std::string& topic = "/imu") {
    put({ms * kOneMs_ns}, 0, topic, bytes);
  }
  void add_at(Timestamp stamp, std::int64_t shift_ns) { put(stamp, shift_ns, "/imu", usual); }
  void put(Timestamp stamp, std::int64_t shift_ns, const std::string& topic, const Bytes& bytes) {
    readings.add({topic, "sensor_msgs/Imu", Layout::kCdr}, {0, stamp, bytes, {}}, shift_ns);
  }
  /// Before anything has come.
  void begin_with(const std::string& topic) {
    ASSERT_TRUE(readings.use(topic, {MotionTopic{topic}}).ok());
  }
  void use(const std::string& choice) { ASSERT_TRUE(readings.use(choice, {}).ok()); }
  void hand_out(int frame) { readings.hand_out(FrameId{static_cast<std::uint32_t>(frame)}); }
  std::vector<std::int64_t> taken_ms(int frame) {
    std::vector<std::int64_t> ms;
    for (const ImuSample& reading : readings.take(FrameId{static_cast<std::uint32_t>(frame)}))
      ms.push_back(reading.stamp.ns / kOneMs_ns);
    return ms;
  }
};

using Ms = std::vector<std::int64_t>;

/// One after the other.
std::string told_by(StreamReadings& readings) {
  std::string all;
  for (const std::string& doubt : readings.take_doubts()) all += doubt + "\n";
  return all;
}

TEST(StreamReadings, BelongToTheFrameTheyCameBefore) {
  Written written;
  written.add(1);
  written.add(1, "/other");
  written.use("/imu");
  written.add(2);
  written.add(2, "/other");
  written.hand_out(0);
  written.add(3);
  written.hand_out(1);
  written.add(4);
  written.hand_out(2);
  EXPECT_EQ(written.taken_ms(0), Ms({1, 2}));
  EXPECT_EQ(written.taken_ms(0), Ms());
  EXPECT_EQ(written.taken_ms(2), Ms({3, 4})) << "late: with those of the frame before";
}

TEST(StreamReadings, NoneAreKeptThatNobodyWants) {
  Written written;
  written.add(1);
  written.hand_out(0);
  written.add(2);
  written.hand_out(1);
  EXPECT_EQ(written.taken_ms(1), Ms());
}

TEST(StreamReadings, OldestGoWhereFramesArePassedOver) {
  Written written;
  written.begin_with("/imu");
  for (std::size_t i = 0; i < kMost + 2; ++i) written.add(static_cast<std::int64_t>(i));
  written.hand_out(0);
  const Ms taken = written.taken_ms(0);
  ASSERT_EQ(taken.size(), kMost);
  EXPECT_EQ(taken.front(), 2);
  EXPECT_EQ(taken.back(), static_cast<std::int64_t>(kMost + 1));
}

TEST(StreamReadings, OldestGoBeforeOneTopicIsWantedAndWhereNobodyTakes) {
  Written written;
  for (std::size_t i = 0; i < kMost + 2; ++i) written.add(static_cast<std::int64_t>(i));
  written.use("/imu");
  written.hand_out(0);
  written.add(static_cast<std::int64_t>(kMost + 2));
  written.hand_out(1);
  const Ms taken = written.taken_ms(1);
  ASSERT_EQ(taken.size(), kMost);
  EXPECT_EQ(taken.front(), 3);
  EXPECT_EQ(taken.back(), static_cast<std::int64_t>(kMost + 2));
}

TEST(StreamReadings, StampsThatCannotBeShiftedAreLeftOut) {
  Written written;
  written.begin_with("/imu");
  written.add_at({10 * kOneMs_ns}, 5 * kOneMs_ns);
  written.add_at({std::numeric_limits<std::int64_t>::max() - kOneMs_ns}, 5 * kOneMs_ns);
  written.add_at({std::numeric_limits<std::int64_t>::min() + kOneMs_ns}, -5 * kOneMs_ns);
  written.add_at({11 * kOneMs_ns}, -5 * kOneMs_ns);
  written.hand_out(0);
  EXPECT_EQ(written.taken_ms(0), Ms({15, 6}));
}

std::string doubt_about_2_s(const Vec3& gyro, const Vec3& accel) {
  const Bytes bytes = unstamped(gyro, accel);
  Written written;
  written.begin_with("/imu");
  for (std::int64_t ms = 0; ms < 2000; ms += 5) written.add_of(ms, bytes);
  EXPECT_EQ(told_by(written.readings), "");
  written.add_of(2000, bytes);
  std::string doubt = told_by(written.readings);
  for (std::int64_t ms = 2005; ms < 9000; ms += 5) written.add_of(ms, bytes);
  EXPECT_EQ(told_by(written.readings), "") << "once";
  return doubt;
}

TEST(StreamReadings, OtherUnitsAndHalvesAreTold) {
  EXPECT_EQ(doubt_about_2_s(kTurning, kGravity), "");
  EXPECT_NE(doubt_about_2_s(kTurning, Vec3(0, 0, 1)).find("units of g"), std::string::npos);
  EXPECT_NE(doubt_about_2_s(Vec3::Zero(), kGravity).find("an accelerometer alone"),
            std::string::npos);
  EXPECT_NE(doubt_about_2_s(kTurning, Vec3::Zero()).find("no gravity"), std::string::npos);
}

TEST(StreamReadings, HalfAnImuIsNotUsed) {
  const Bytes half = unstamped(Vec3::Zero(), kGravity), whole = unstamped(kTurning, kGravity);
  Written written;
  written.begin_with("/imu");
  for (std::int64_t ms = 0; ms <= 2000; ms += 5) written.add_of(ms, half);
  written.hand_out(0);
  for (std::int64_t ms = 2005; ms <= 3000; ms += 5) written.add_of(ms, half);
  written.hand_out(1);
  EXPECT_EQ(written.taken_ms(0).empty(), false) << "nobody knew";
  EXPECT_EQ(written.taken_ms(1), Ms());
  written.add_of(3005, whole);
  written.add_of(3010, half);
  written.hand_out(2);
  EXPECT_EQ(written.taken_ms(2).size(), 2U) << "it was at rest";
}

TEST(StreamReadings, OneASecondAreTold) {
  Written written;
  written.begin_with("/imu");
  std::string doubt;
  for (std::int64_t ms = 0; ms < 9000; ms += 1000) {
    written.add(ms);
    doubt += told_by(written.readings);
  }
  EXPECT_EQ(doubt, "/imu: readings are 1 s apart, which no inertial sensor's are\n");
}

TEST(StreamReadings, ThoseThatAreNoNumbersAreCounted) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const Bytes none = unstamped(kTurning, Vec3(0, 0, kNan));
  Written written;
  written.add_of(0, none);
  written.begin_with("/imu");
  std::vector<std::string> told;
  for (std::int64_t ms = 5; ms < 900; ms += 5) {
    written.add_of(ms, ms % 3 == 0 ? none : written.usual);
    written.add_of(ms, none, "/other");
    if (std::string doubt = told_by(written.readings); !doubt.empty())
      told.push_back(std::move(doubt));
  }
  const std::string what = "/imu: no finite numbers of sensible size in ";
  EXPECT_EQ(told, (std::vector{what + "1 reading so far: left out\n",
                               what + "10 readings so far: left out\n"}));
}

TEST(StreamReadings, OneDoubtDoesNotHideAnother) {
  Written written;
  written.begin_with("/imu");
  written.add_of(0, unstamped(kTurning, Vec3(0, 0, std::numeric_limits<double>::quiet_NaN())));
  const Bytes in_g = unstamped(kTurning, Vec3(0, 0, 1));
  for (std::int64_t ms = 5; ms < 2100; ms += 5) written.add_of(ms, in_g);
  const std::vector<std::string> doubts = written.readings.take_doubts();
  ASSERT_EQ(doubts.size(), 2U);
  EXPECT_NE(doubts[0].find("in 1 reading so far"), std::string::npos) << doubts[0];
  EXPECT_NE(doubts[1].find("units of g"), std::string::npos) << doubts[1];
}

TEST(StreamReadings, HalvesOfOneSensorAreUnited) {
  const Bytes gyro = unstamped(kTurning, Vec3::Zero()), accel = unstamped(Vec3::Zero(), kGravity);
  Written written;
  for (std::int64_t ms = 0; ms < 40; ms += 5) written.add_of(ms, gyro, "/gyro");
  for (std::int64_t ms = 2; ms < 40; ms += 16) written.add_of(ms, accel, "/accel");
  const auto chosen = written.readings.use("", {});
  ASSERT_TRUE(chosen.ok()) << chosen.error().message;
  EXPECT_EQ(chosen->gyro, "/gyro");
  EXPECT_EQ(chosen->accel, "/accel");
  written.hand_out(0);
  EXPECT_EQ(written.taken_ms(0), Ms({5, 10, 15, 20, 25, 30})) << "35 waits for an acceleration";
  for (std::int64_t ms = 40; ms < 60; ms += 5) written.add_of(ms, gyro, "/gyro");
  written.add_of(50, accel, "/accel");
  written.add_of(50, accel, "/other");
  written.hand_out(1);
  EXPECT_EQ(written.taken_ms(1), Ms({35, 40, 45, 50}));
}

TEST(StreamReadings, OneOfSeveralTopicsHasToBeChosen) {
  Written written;
  written.add(1);
  written.add(1, "/other");
  const auto none = written.readings.use("", {});
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().message.find("/imu (1 readings), /other"), std::string::npos);
  EXPECT_FALSE(written.readings.use("/no", {}).ok());
  EXPECT_TRUE(written.readings.use("/later", {MotionTopic{"/later"}}).ok()) << "it was announced";
}

TEST(StreamReadings, StampsOfAnyTimeAreJudged) {
  Written written;
  written.begin_with("/imu");
  const Bytes in_g = unstamped(kTurning, Vec3(0, 0, 1));
  for (const std::int64_t ns :
       {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()})
    written.add_at({ns}, 0);
  for (std::int64_t ms = 2000; ms >= 0; ms -= 5) written.add_of(ms, in_g);
  EXPECT_NE(told_by(written.readings).find("units of g"), std::string::npos);
}

TEST(StreamReadings, OneThreadReadsAnotherTakes) {
  constexpr int kFrames = 500;
  constexpr std::int64_t kOfFrame = 7;
  Written written;
  written.begin_with("/imu");
  std::jthread reads([&] {
    for (int k = 0; k < kFrames; ++k) {
      for (std::int64_t i = 0; i < kOfFrame; ++i) written.add(k * kOfFrame + i);
      written.hand_out(k);
    }
  });
  Ms all;
  while (all.size() < kFrames * kOfFrame) {
    const Ms some = written.taken_ms(kFrames);
    all.insert(all.end(), some.begin(), some.end());
    std::this_thread::yield();
  }
  for (std::size_t i = 0; i < all.size(); ++i)
    ASSERT_EQ(all[i], static_cast<std::int64_t>(i)) << "in order, each once";
}

}  // namespace
}  // namespace ygslam
