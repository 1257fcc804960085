// A camera with an IMU whose lens is covered: its place is known on, as well as it says, and what
// it sees again is where it should be.
#include <gtest/gtest.h>

#include "geometry/random_vector.hpp"
#include "simulation/sensor/imu_sensor.hpp"
#include "system/testing/painted_recording.hpp"

namespace ygslam::system_test {
namespace {

constexpr double kCoveredFrom_s = 4, kCoveredUntil_s = 6;

/// Level, its y axis down, as it begins.
SE3 T_level_odom() {
  Mat3 R;
  R << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return {R, Vec3::Zero()};
}

ImuCalibration calibration() {
  ImuCalibration imu;
  imu.T_camera_imu = sim::default_imu_pose();
  return imu;
}

/// What the painted camera's IMU reads, with a bias, as a BMI085 might.
std::vector<ImuSample> readings(double seconds, std::int64_t offset_ns = 0) {
  constexpr double kRate_hz = 200;
  const ImuNoise noise;
  const SE3 T_camera_imu = calibration().T_camera_imu;
  const sim::Motion motion = [&](double t_s) {
    return T_level_odom() * painted_pose(t_s) * T_camera_imu;
  };
  Rng rng(7);
  const auto white = [&rng](double density) -> Vec3 {
    return random_normals<3>(rng) * density * std::sqrt(kRate_hz);
  };
  std::vector<ImuSample> samples;
  for (int i = -20; i < kRate_hz * seconds; ++i) {
    const sim::TrueMotion truth = sim::true_motion(motion, i / kRate_hz);
    samples.push_back({{1'000'000'000 + offset_ns + to_ns(i / kRate_hz)},
                       truth.angular_velocity_radps + Vec3(0.01, -0.005, 0.004) +
                           white(noise.gyro_noise_radps_sqrthz),
                       truth.specific_force_mps2 + Vec3(-0.05, 0.03, 0.06) +
                           white(noise.accel_noise_mps2_sqrthz)});
  }
  return samples;
}

Recording covered_recording(double seconds) {
  Recording recording = painted_recording({.seconds = seconds, .fps = 30});
  recording.spoil(kCoveredFrom_s, kCoveredUntil_s, [](RgbdFrame& frame) {
    std::fill(frame.grey.begin(), frame.grey.end(), std::uint8_t{0});
    std::fill(frame.colour.begin(), frame.colour.end(), Rgb8{});
    std::fill(frame.depth_m.begin(), frame.depth_m.end(), 0.0F);
  });
  return recording;
}

Trial run_with(std::unique_ptr<Runner> runner, const Recording& recording,
               const std::vector<ImuSample>& samples) {
  Trial trial(std::move(runner));
  auto next = samples.begin();
  for (const FramePtr& frame : recording.frames) {
    while (next != samples.end() && next->stamp.ns < frame->stamp.ns + to_ns(0.01))
      trial.runner->add(*next++);
    trial.process(frame);
  }
  trial.finish();
  return trial;
}

SlamConfig with_imu() {
  SlamConfig config = small_config(DynamicMode::kOff);
  config.imu = calibration();
  return config;
}

void expect_carried_through(const Recording& recording, const Trial& run) {
  EXPECT_EQ(lost_frames(run), 0);
  int coasting = 0;
  for (std::size_t i = 1; i < recording.frames.size(); ++i) {
    const TrackResult& now = run.results[i];
    const bool covered =
        recording.time_s(i) >= kCoveredFrom_s && recording.time_s(i) < kCoveredUntil_s;
    EXPECT_EQ(now.state == TrackState::kCoasting, covered) << recording.time_s(i);
    coasting += covered ? 1 : 0;
    EXPECT_EQ(now.provisional, covered);
    const double error_m = drift_m(recording, run, i);
    if (covered) {
      EXPECT_LT(error_m, 4 * run.frames[i].position_std_m) << recording.time_s(i);
      if (i > 1 && run.results[i - 1].state == TrackState::kCoasting) {
        EXPECT_GT(run.frames[i].position_std_m, run.frames[i - 1].position_std_m);
      }
    } else {
      EXPECT_LT(error_m, 0.01) << recording.time_s(i);
    }
    // odom never jumps: the camera goes at most 0.4 m/s.
    const double step_m = (now.T_odom_camera.t() - run.results[i - 1].T_odom_camera.t()).norm();
    EXPECT_LT(step_m, 0.03) << recording.time_s(i);
  }
  EXPECT_EQ(coasting, 60);
  EXPECT_EQ(run.outcome.statistics.coasting, 60U);
  // In the end the frames in between lie better: what came after tells how far they had drifted.
  EXPECT_LT(ate_rmse_m(recording, run.trajectory()), 0.01);
  EXPECT_LE(ate_rmse_m(recording, run.trajectory()), ate_rmse_m(recording, run.live_trajectory()));
}

TEST(Coasting, ACoveredLensLosesNothing) {
  const Recording recording = covered_recording(8);
  expect_carried_through(
      recording,
      run_with(make_offline_runner(with_imu(), recording.camera, nullptr), recording, readings(8)));
}

TEST(Coasting, AClockThatIsLateIsFound) {
  const Recording recording = covered_recording(8);
  expect_carried_through(
      recording, run_with(make_offline_runner(with_imu(), recording.camera, nullptr), recording,
                          readings(8, to_ns(0.008))));
}

TEST(Coasting, WithoutAnImuItIsLostAndOneThatIsNotAskedForChangesNothing) {
  const Recording recording = covered_recording(7);
  const SlamConfig config = small_config(DynamicMode::kOff);
  const Trial without = run_offline(config, recording);
  EXPECT_EQ(lost_frames(without), 60);
  const Trial unasked =
      run_with(make_offline_runner(config, recording.camera, nullptr), recording, readings(7));
  ASSERT_EQ(unasked.results.size(), without.results.size());
  for (std::size_t i = 0; i < without.results.size(); ++i)
    EXPECT_EQ(unasked.results[i].T_world_camera.t(), without.results[i].T_world_camera.t());
}

TEST(Coasting, AnImuThatStopsDoesNotCarryOn) {
  const Recording recording = covered_recording(7);
  std::vector<ImuSample> samples = readings(7);
  std::erase_if(samples, [](const ImuSample& s) { return s.stamp.ns > 1'000'000'000 + to_ns(3); });
  const Trial run =
      run_with(make_offline_runner(with_imu(), recording.camera, nullptr), recording, samples);
  EXPECT_EQ(run.outcome.statistics.coasting, 0U);
  EXPECT_GT(lost_frames(run), 50);
}

/// Keyframes of the map that an IMU told of gravity or of turns.
int told_keyframes(const Trial& run) {
  const Map map = run.map();
  return static_cast<int>(std::ranges::count_if(map.keyframes(), [](const auto& entry) {
    return entry.second.data->gravity || entry.second.data->turn;
  }));
}

TEST(DroppedImu, WhatItSaidLeavesTheMapWhereItWasWrong) {
  const Recording recording = painted_recording({.seconds = 6, .fps = 30});
  const auto told = [&](auto make_runner, const std::vector<ImuSample>& samples) {
    const Trial run =
        run_with(make_runner(with_imu(), recording.camera, nullptr, MapUse{}), recording, samples);
    EXPECT_EQ(lost_frames(run), 0);
    EXPECT_LT(ate_rmse_m(recording, run.trajectory()), 0.01);
    return told_keyframes(run);
  };
  std::vector<ImuSample> wrong = readings(6), silent = wrong;
  for (ImuSample& sample : wrong)
    if (sample.stamp.ns > 1'000'000'000 + to_ns(4)) sample.specific_force_mps2 *= 1.5;
  std::erase_if(silent, [](const ImuSample& s) { return s.stamp.ns > 1'000'000'000 + to_ns(4); });
  for (const auto make_runner : {&make_offline_runner, &make_live_runner}) {
    EXPECT_GE(told(make_runner, silent), 2);
    EXPECT_EQ(told(make_runner, wrong), 0);
  }
}

TEST(Coasting, ResetForgetsWhatTheImuTold) {
  const Recording recording = covered_recording(7);
  const std::vector<ImuSample> samples = readings(7);
  const auto runner = make_live_runner(with_imu(), recording.camera, nullptr);
  auto next = samples.begin();
  for (std::size_t i = 0; i < recording.frames.size(); ++i) {
    const FramePtr& frame = recording.frames[i];
    while (next != samples.end() && next->stamp.ns < frame->stamp.ns + to_ns(0.01))
      runner->add(*next++);
    if (i == 115) runner->reset();  // just before the lens is covered: too late for a new start
    const TrackResult result = runner->process(frame);
    if (recording.time_s(i) >= kCoveredFrom_s && recording.time_s(i) < kCoveredUntil_s) {
      EXPECT_EQ(result.state, TrackState::kLost) << recording.time_s(i);
    }
  }
}

}  // namespace
}  // namespace ygslam::system_test
