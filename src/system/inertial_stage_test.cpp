#include "system/inertial_stage.hpp"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>

#include "core/log.hpp"
#include "inertial/inertial_test_world.hpp"

namespace ygslam {
namespace {

/// A camera at rest, at 30 Hz.
class InertialStageTest : public ::testing::Test {
 protected:
  static constexpr double kFrame_s = 1.0 / 30;

  static ImuCalibration calibration() {
    ImuCalibration imu;
    imu.time_offset_s = 0;
    return imu;
  }
  void feed_samples() {
    const double period_s = 1 / calibration().noise.rate_hz;
    for (; next_sample_s_ <= now_s_ + period_s; next_sample_s_ += period_s)
      stage_.add(imu_.measure({{to_ns(next_sample_s_)}, Vec3::Zero(), {0, 0, gravity_mps2_}}));
  }
  std::optional<CameraTurn> see(TrackState state, bool overruled = false) {
    TrackResult result;
    result.state = state;
    result.overruled = overruled;
    result.matches = 200;
    result.covariance = 1e-6 * Mat6::Identity();
    auto turn = stage_.take({to_ns(now_s_)}, result);
    if (result.imu_retraction)
      retracted_since_s_.push_back(1e-9 * static_cast<double>(result.imu_retraction->since.ns));
    return turn;
  }
  std::optional<CameraTurn> frame(TrackState state, bool overruled = false) {
    now_s_ += kFrame_s;
    feed_samples();
    return see(state, overruled);
  }
  void run(double seconds, TrackState state, bool overruled = false) {
    const double until_s = now_s_ + seconds;
    while (now_s_ < until_s) frame(state, overruled);
  }
  [[nodiscard]] bool is_predicted() const { return stage_.predict({to_ns(now_s_)}).has_value(); }

  InertialStage stage_{calibration(), std::nullopt};
  inertial_world::NoisyImu imu_{calibration().noise, ImuBias{}, 1};
  std::vector<double> retracted_since_s_;
  double now_s_ = 0, next_sample_s_ = -0.1;
  double gravity_mps2_ = 9.81;
};

TEST_F(InertialStageTest, AnImuThatVisionDoesNotComeBackToIsDropped) {
  run(7, TrackState::kTracking);
  run(7, TrackState::kCoasting, true);
  frame(TrackState::kTracking);
  EXPECT_TRUE(is_predicted()) << "it came back in time";
  run(9, TrackState::kCoasting, true);
  EXPECT_TRUE(is_predicted());
  frame(TrackState::kTracking);
  EXPECT_FALSE(is_predicted());
}

TEST_F(InertialStageTest, WhatIsBeyondTheToldRangeIsNoReading) {
  run(3, TrackState::kTracking);
  EXPECT_TRUE(is_predicted());
  ImuCalibration imu = calibration();
  imu.accel_range_mps2 = 0.8 * gravity_mps2_;
  InertialStage ranged(imu, std::nullopt);
  for (int i = 0; i < 90; ++i) {
    for (int k = 0; k < 7; ++k)
      ranged.add(imu_.measure(
          {{to_ns(kFrame_s * (i - 1) + 0.005 * k)}, Vec3::Zero(), {0, 0, gravity_mps2_}}));
    TrackResult seen{.state = TrackState::kTracking};
    seen.covariance = 1e-6 * Mat6::Identity();
    ranged.take({to_ns(kFrame_s * i)}, seen);
  }
  EXPECT_FALSE(ranged.predict({to_ns(kFrame_s * 90)}).has_value());
}

TEST_F(InertialStageTest, AnImuWhoseSamplesAreLateIsNotDropped) {
  run(7, TrackState::kTracking);
  run(0.5, TrackState::kCoasting, true);
  now_s_ += 0.25;
  EXPECT_FALSE(is_predicted());
  see(TrackState::kTracking);
  run(0.1, TrackState::kTracking);
  EXPECT_TRUE(is_predicted());
}

TEST_F(InertialStageTest, WhatAWrongImuSaidSinceItsStartIsTakenBack) {
  run(3, TrackState::kTracking);
  gravity_mps2_ = 14;
  run(3, TrackState::kTracking);
  ASSERT_EQ(retracted_since_s_.size(), 1U) << "it does not start again";
  EXPECT_NEAR(retracted_since_s_[0], 1, 0.2) << "a start takes a second";
  gravity_mps2_ = 9.81;
  const double healed_s = now_s_;
  run(3, TrackState::kTracking);
  EXPECT_TRUE(is_predicted());
  gravity_mps2_ = 14;
  run(3, TrackState::kTracking);
  ASSERT_EQ(retracted_since_s_.size(), 2U);
  EXPECT_GT(retracted_since_s_[1], healed_s) << "what came before was taken back";
}

TEST_F(InertialStageTest, AnotherRunBeginsAnewThoughItsTimeIsEarlier) {
  run(3, TrackState::kTracking);
  EXPECT_TRUE(is_predicted());
  std::map<std::string, int> told;
  const log::ScopedSink sink(std::make_shared<const log::Sink>(
      [&](log::Level, const std::string& line) { ++told[line.substr(0, 24)]; }));
  stage_.reset();
  now_s_ = 1;
  next_sample_s_ = 0.9;
  run(0.5, TrackState::kTracking);
  EXPECT_FALSE(is_predicted());
  run(1.5, TrackState::kTracking);
  EXPECT_TRUE(is_predicted());
  EXPECT_EQ(told, (std::map<std::string, int>{{"IMU: gravity and biases ", 1}}));
  EXPECT_TRUE(retracted_since_s_.empty());
}

TEST_F(InertialStageTest, WhatAnImuSaidBeforeItStoppedStands) {
  run(3, TrackState::kTracking);
  now_s_ += 1;
  next_sample_s_ = now_s_;  // a gap
  for (int i = 0; i < 10; ++i) frame(TrackState::kTracking);
  EXPECT_FALSE(is_predicted()) << "it was dropped";
  gravity_mps2_ = 14;
  run(3, TrackState::kTracking);
  EXPECT_TRUE(retracted_since_s_.empty()) << "wrong, it did not start again";
}

TEST_F(InertialStageTest, TellsHowTheCameraTurnedSinceTheFrameBefore) {
  EXPECT_FALSE(frame(TrackState::kTracking)) << "it is the first";
  const auto turn = frame(TrackState::kTracking);
  ASSERT_TRUE(turn);
  EXPECT_LT(turn->turn_rad.norm(), 1e-3);
  EXPECT_TRUE(frame(TrackState::kCoasting));
  EXPECT_FALSE(frame(TrackState::kLost)) << "it has no pose";
  EXPECT_TRUE(frame(TrackState::kTracking)) << "since the last that has one";
  run(0.3, TrackState::kLost);
  EXPECT_FALSE(frame(TrackState::kTracking)) << "too long ago";
}

TEST_F(InertialStageTest, WhatIsWrongAllTheTimeIsToldSeldom) {
  std::map<std::string, int> told;
  const log::ScopedSink sink(
      std::make_shared<const log::Sink>([&](log::Level level, const std::string& line) {
        told[line] += level == log::Level::kWarning;
      }));
  gravity_mps2_ = 12.5;
  run(40, TrackState::kTracking);
  const std::string line =
      "IMU: what it measures is not gravity's size: it is not used until that has changed";
  EXPECT_EQ(told, (std::map<std::string, int>{{line, 1}, {line + " (10 times so far)", 1}}));
  stage_.reset();
  run(3, TrackState::kTracking);
  EXPECT_EQ(told[line], 2) << "another run";
}

TEST_F(InertialStageTest, AKeyframeIsToldWhereGravityPulls) {
  const auto proposed = [&](bool with_samples) {
    now_s_ += kFrame_s;
    if (with_samples) feed_samples();
    auto frame = std::make_shared<RgbdFrame>();
    frame->stamp = {to_ns(now_s_)};
    TrackResult result;
    result.state = TrackState::kTracking;
    result.matches = 200;
    result.covariance = 1e-6 * Mat6::Identity();
    result.candidate.emplace();
    result.candidate->frame = frame;
    stage_.take({to_ns(now_s_)}, result);
    return result.candidate->gravity;
  };
  EXPECT_FALSE(proposed(true)) << "before anything is known";
  run(3, TrackState::kTracking);
  const auto first = proposed(true), second = proposed(true);
  ASSERT_TRUE(first && second);
  const Vec3 down = calibration().T_camera_imu.R() * Vec3(0, 0, -1);
  EXPECT_LT((first->down_camera - down).norm(), 0.02);
  EXPECT_GT(first->covariance.trace(), 0);
  EXPECT_GT(second->covariance.trace(), 10 * first->covariance.trace())
      << "a frame later the same readings say it";
  now_s_ += 0.1;
  EXPECT_FALSE(proposed(false)) << "its readings are not there";
}

// Vision that leans more and more, and says so, does not take gravity along.
TEST_F(InertialStageTest, DriftOfOdomDoesNotBendGravity) {
  run(5, TrackState::kTracking);
  const SE3 T_step(so3_exp({0.0007, 0, 0}), Vec3::Zero());
  TrackResult result;
  for (int i = 0; i < 90; ++i) {
    now_s_ += kFrame_s;
    feed_samples();
    const SE3 T_odom_camera = result.T_odom_camera;
    const Doubt odom = result.doubt.odom;
    result = {};
    result.state = TrackState::kTracking;
    result.matches = 200;
    result.covariance = 1e-6 * Mat6::Identity();
    result.T_odom_camera = T_step * T_odom_camera;
    result.doubt.odom = {odom.position_m2, odom.rotation_rad2 + 4e-6};
    auto frame = std::make_shared<RgbdFrame>();
    frame->stamp = {to_ns(now_s_)};
    result.candidate.emplace();
    result.candidate->frame = frame;
    const SE3 seen = result.T_odom_camera;
    stage_.take({to_ns(now_s_)}, result);
    result.T_odom_camera = seen;  // what the points say, wherever the gyroscope holds it
  }
  ASSERT_TRUE(result.candidate->gravity);
  const Vec3 down = calibration().T_camera_imu.R() * Vec3(0, 0, -1);
  EXPECT_LT((result.candidate->gravity->down_camera - down).norm(), 0.005);
}

TEST_F(InertialStageTest, AnImuOfAnotherTimeIsTold) {
  std::map<std::string, int> told;
  const log::ScopedSink sink(std::make_shared<const log::Sink>(
      [&](log::Level, const std::string& line) { ++told[line]; }));
  now_s_ = 900;
  for (int i = 0; i < 100; ++i) {
    now_s_ += kFrame_s;
    stage_.add({{to_ns(now_s_ - 900)}, Vec3::Zero(), {0, 0, 9.81}});
    see(TrackState::kTracking);
  }
  const std::string line =
      "IMU: none of its readings is of the images' time: it is not used until that has changed";
  EXPECT_EQ(told, (std::map<std::string, int>{{line, 1}}));
}

TEST_F(InertialStageTest, WhyItWasOfNoUseIsToldAfterAShortRecording) {
  std::map<std::string, int> told;
  const log::ScopedSink sink(std::make_shared<const log::Sink>(
      [&](log::Level, const std::string& line) { ++told[line]; }));
  const auto see_a_second = [&] {
    for (int i = 0; i < 30; ++i) {
      now_s_ += kFrame_s;
      see(TrackState::kTracking);
    }
    stage_.finish();
    stage_.finish();
    stage_.reset();
    return std::exchange(told, {});
  };
  using Lines = std::map<std::string, int>;
  EXPECT_EQ(see_a_second(), (Lines{{"IMU: no reading came: it was not used", 1}}));
  stage_.add({{to_ns(now_s_ + 50)}, Vec3::Zero(), {0, 0, 9.81}});
  EXPECT_EQ(see_a_second(),
            (Lines{{"IMU: none of its readings is of the images' time: it was not used", 1}}));
  for (int i = 0; i < 10; ++i) frame(TrackState::kTracking);
  stage_.finish();
  EXPECT_EQ(told,
            (Lines{{"IMU: a second of poses is needed before it is of use, which never came", 1}}));
  told.clear();
  stage_.reset();
  run(3, TrackState::kTracking);
  stage_.finish();
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told.begin()->first.find("IMU: gravity and biases are known"), 0U);
}

TEST(InertialReport, ThatItBeganIsToldOnceAndAfterAFaultThatWasTold) {
  std::vector<std::string> told;
  const log::ScopedSink sink(std::make_shared<const log::Sink>(
      [&](log::Level, const std::string& line) { told.push_back(line.substr(0, 12)); }));
  const std::string began = "IMU: gravity";
  InertialReport report;
  report.imu_began({0, 0, -9.8});
  report.imu_began({0, 0, -9.8});
  EXPECT_EQ(told, std::vector{began});
  const auto faults = [&](int count) {
    told.clear();
    for (int i = 0; i < count; ++i) {
      report.imu_dropped(ImuFault::kSilent);
      report.imu_began({0, 0, -9.8});
    }
    return told.size();
  };
  EXPECT_EQ(faults(1), 2U);
  EXPECT_EQ(faults(8), 0U) << "the second to the ninth are not told";
  EXPECT_EQ(faults(1), 2U);
}

TEST(InertialStageOfWheels, ThatNoPoseOfTheWheelsCameIsTold) {
  using Lines = std::map<std::string, int>;
  Lines told;
  const log::ScopedSink sink(std::make_shared<const log::Sink>(
      [&](log::Level, const std::string& line) { ++told[line]; }));
  InertialStage stage(std::nullopt, WheelCalibration{});
  const auto told_after = [&](double seconds, bool one_comes) {
    stage.reset();
    if (one_comes) stage.add(OdometrySample{});
    for (double t_s = 0; t_s < seconds; t_s += 1.0 / 30) {
      TrackResult result;
      result.state = TrackState::kTracking;
      stage.take({to_ns(t_s)}, result);
    }
    stage.finish();
    stage.finish();
    return std::exchange(told, {});
  };
  EXPECT_EQ(told_after(1, false), (Lines{{"wheels: no pose came: they were not used", 1}}));
  EXPECT_EQ(told_after(9, false), (Lines{{"wheels: no valid pose came in the first 2 s: they are "
                                          "not used until that has changed",
                                          1}}));
  EXPECT_EQ(told_after(0.2, true), Lines());
}

}  // namespace
}  // namespace ygslam
