// The pose of the moment, held by a gyroscope, where the camera turns fast.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>

#include "geometry/smooth_turns.hpp"
#include "simulation/sequence/inertial_files.hpp"
#include "system/testing/rendered_recording.hpp"

namespace ygslam::system_test {
namespace {

constexpr double kSeconds = 8;

/// Turned by 60 degrees a second, blurred over half of a frame's time (bench/turns.py, `fast`).
sim::WorldConfig fast_world() {
  auto world = sim::parse_world(R"(seconds: 25
layout: office_sitters
camera: {path: rpy, at: [0, -1.7, 1.35], look_at: [0, 1.5, 1.0], speed: 0.1, turning: 60}
)",
                                "fast");
  CHECK(world.ok(), world.error().message.c_str());
  return std::move(world).value();
}

/// How far a path is from the truth, laid onto it, and each of its steps.
struct Errors {
  double ate_m = 0, step_m = 0, step_rad = 0;  // root mean squares
};

/// A run, and where its points alone had the camera.
struct HeldTrial {
  Trial trial;
  std::vector<std::optional<SE3>> T_world_points;  ///< per frame

  [[nodiscard]] std::vector<StampedPose> by_points() const {
    std::vector<StampedPose> poses;
    for (std::size_t i = 0; i < T_world_points.size(); ++i)
      if (T_world_points[i]) poses.push_back({trial.frames[i].stamp, *T_world_points[i]});
    return poses;
  }
};

class FastTurns : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    sim::SequenceOptions options = small(kSeconds);
    options.fps = 30;
    options.noise = sim::NoiseKind::kKinect;
    options.blur = 0.5;
    auto source = sim::open_world(fast_world(), options);
    CHECK(source.ok(), source.error().message.c_str());
    sim::ImuOptions imu;
    imu.model = *sim::find_imu_model("BMI085");
    calibration_ = sim::known_calibration(imu);
    for (const sim::ImuReading& reading :
         sim::imu_readings(source->path(), imu, source->start(), -0.1, kSeconds + 0.1))
      readings_.push_back(reading.sample);
    recording_ = std::make_unique<Recording>(record_all(*source));
    with_ = std::make_unique<HeldTrial>(run(true));
  }
  static void TearDownTestSuite() {
    with_.reset();
    recording_.reset();
    readings_.clear();
  }

  static HeldTrial run(bool with_imu) {
    SlamConfig config = small_config(DynamicMode::kFull);
    if (with_imu) config.imu = calibration_;
    HeldTrial run{Trial(make_offline_runner(config, recording_->camera,
                                            std::make_unique<TruthSegmenter>(*recording_))),
                  {}};
    Runner& runner = *run.trial.runner;
    auto next = readings_.begin();
    for (const FramePtr& frame : recording_->frames) {
      for (; next != readings_.end() && next->stamp.ns < frame->stamp.ns + to_ns(0.01); ++next)
        runner.add(*next);
      const Map map = runner.map();  // that the frame is found in
      run.trial.process(frame);
      const TrackResult& result = run.trial.results.back();
      run.T_world_points.emplace_back();
      if (has_pose(result.state) && map.has_keyframe(result.pose.reference))
        run.T_world_points.back() =
            (result.pose.T_camera_reference * map.keyframe(result.pose.reference).T_camera_world)
                .inverse();
    }
    run.trial.finish();
    return run;
  }

  /// @param path of all frames but the first few.
  static Errors errors_of(const std::vector<StampedPose>& path) {
    const auto truth_at = [](Timestamp stamp) {
      return std::ranges::find(recording_->truth, stamp, &StampedPose::stamp)->T_world_camera;
    };
    Errors errors;
    for (std::size_t i = 1; i < path.size(); ++i) {
      const SE3 T_true = truth_at(path[i - 1].stamp).inverse() * truth_at(path[i].stamp);
      const SE3 T_told = path[i - 1].T_world_camera.inverse() * path[i].T_world_camera;
      errors.step_m += (T_true.t() - T_told.t()).squaredNorm();
      errors.step_rad += std::pow((T_true.inverse() * T_told).angle(), 2);
    }
    const double steps = static_cast<double>(path.size()) - 1;
    return {ate_rmse_m(*recording_, path), std::sqrt(errors.step_m / steps),
            std::sqrt(errors.step_rad / steps)};
  }

  static inline std::unique_ptr<Recording> recording_;
  static inline std::unique_ptr<HeldTrial> with_;  // an IMU
  static inline std::vector<ImuSample> readings_;
  static inline ImuCalibration calibration_;
};

TEST_F(FastTurns, AGyroscopeMakesThePoseOfTheMomentBetter) {
  const HeldTrial without = run(false);
  EXPECT_EQ(lost_frames(with_->trial), 0);
  EXPECT_EQ(lost_frames(without.trial), 0);
  const auto tell = [](const char* what, const Errors& errors) {
    std::printf("%s: ATE %.2f mm, from frame to frame %.2f mm, %.2f mrad\n", what,
                1e3 * errors.ate_m, 1e3 * errors.step_m, 1e3 * errors.step_rad);
    return errors;
  };
  const Errors held = tell("held", errors_of(with_->trial.live_trajectory()));
  for (const Errors& points : {tell("its points", errors_of(with_->by_points())),
                               tell("no IMU", errors_of(without.trial.live_trajectory()))}) {
    EXPECT_LT(held.step_rad, 0.65 * points.step_rad);
    EXPECT_LT(held.step_m, 0.75 * points.step_m);
    EXPECT_LT(held.ate_m, points.ate_m);
  }
  for (std::size_t i = 0; i < without.T_world_points.size(); ++i) {
    if (!without.T_world_points[i]) continue;
    const SE3 T_points_told =
        without.T_world_points[i]->inverse() * without.trial.results[i].T_world_camera;
    EXPECT_LT(T_points_told.log().norm(), 1e-9) << i << ": nobody holds it";
  }
}

TEST_F(FastTurns, WhatIsToldStaysWithinWhatThePointsAllowFor) {
  int moved = 0;
  for (std::size_t i = 0; i < with_->T_world_points.size(); ++i) {
    const TrackResult& result = with_->trial.results[i];
    if (!with_->T_world_points[i] || !result.covariance || result.state != TrackState::kTracking)
      continue;
    const Vec6 off = (with_->T_world_points[i]->inverse() * result.T_world_camera).log();
    const Vec3 off_rad = off.tail<3>();
    Mat3 seen = result.covariance->bottomRightCorner<3, 3>();
    seen.diagonal().array() += kLeastTurnStd_rad * kLeastTurnStd_rad;
    EXPECT_LT(off_rad.dot(seen.ldlt().solve(off_rad)), 1.0001 * kLastingFactor * kLastingFactor)
        << i;
    const Vec3 goes_along = result.covariance->topRightCorner<3, 3>() * seen.ldlt().solve(off_rad);
    EXPECT_LT((off.head<3>() - goes_along).norm(), 1e-6) << i;
    moved += off_rad.norm() > 1e-4 ? 1 : 0;
  }
  EXPECT_GT(moved, 100);
}

}  // namespace
}  // namespace ygslam::system_test
