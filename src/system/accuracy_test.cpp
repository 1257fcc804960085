// The whole line on rendered worlds whose truth is exact.
#include <gtest/gtest.h>

#include "system/testing/rendered_recording.hpp"

namespace ygslam::system_test {
namespace {

sim::SequenceOptions large(double seconds, sim::NoiseKind noise) {
  sim::SequenceOptions options = small(seconds);
  options.fps = 10;
  options.width = 640;
  options.height = 480;
  options.noise = noise;
  return options;
}

SlamConfig full_size_config(DynamicMode mode) {
  SlamConfig config = small_config(mode);
  config.orb.features = OrbConfig{}.features;
  return config;
}

// Shares of the features on and off the movers that a run called dynamic.
struct DynamicShares {
  double on_mover = 0, elsewhere = 0;
};

DynamicShares dynamic_shares(const Recording& recording, const Trial& run, std::size_t from) {
  double count[2] = {0, 0}, dynamic[2] = {0, 0};
  for (std::size_t i = from; i < run.results.size(); ++i) {
    const TrackResult& result = run.results[i];
    for (std::size_t k = 0; k < result.labels.label.size(); ++k) {
      const Eigen::Vector2f uv_px = result.features->points[k].uv_px;
      const int u = static_cast<int>(std::lround(uv_px.x()));
      const int v = static_cast<int>(std::lround(uv_px.y()));
      const std::size_t on = recording.ids[i].at(u, v) ? 1 : 0;
      count[on] += 1;
      dynamic[on] += result.labels.label[k] == MotionLabel::kDynamic ? 1 : 0;
    }
  }
  return {count[1] > 0 ? dynamic[1] / count[1] : 0, count[0] > 0 ? dynamic[0] / count[0] : 0};
}

TEST(Accuracy, StaticWorldWithoutNoiseStaysWithinThreeMillimetres) {
  const Recording recording = record("static_xyz", large(3, sim::NoiseKind::kNone));
  const Trial run = run_offline(full_size_config(DynamicMode::kOff), recording);
  EXPECT_EQ(lost_frames(run), 0);
  EXPECT_LT(ate_rmse_m(recording, run.trajectory()), 0.003);
  EXPECT_LT(ate_rmse_m(recording, run.live_trajectory()), 0.004);
}

TEST(Accuracy, StaticWorldWithSensorNoiseStaysWithinTenMillimetres) {
  const Recording recording = record("static_xyz", large(3, sim::NoiseKind::kKinect));
  for (const DynamicMode mode : {DynamicMode::kOff, DynamicMode::kFull}) {
    const Trial run = run_offline(full_size_config(mode), recording);
    EXPECT_EQ(lost_frames(run), 0) << mode_name(mode);
    EXPECT_LT(ate_rmse_m(recording, run.trajectory()), 0.010) << mode_name(mode);
  }
}

TEST(Accuracy, AStillWorldIsHardlyEverCalledDynamic) {
  const Recording recording = record("static_xyz", small(2));
  const Trial run = run_offline(small_config(DynamicMode::kGeometry), recording);
  EXPECT_LT(dynamic_shares(recording, run, 1).elsewhere, 0.01);
}

TEST(Accuracy, MasksKeepAMovingBoxOutOfPoseAndMap) {
  Recording recording = record("moving_box", small(5));
  const Trial run = run_offline(small_config(DynamicMode::kFull), recording,
                                std::make_unique<TruthSegmenter>(recording));
  EXPECT_EQ(lost_frames(run), 0);
  EXPECT_LT(ate_rmse_m(recording, run.trajectory()), 0.012);
  const DynamicShares shares = dynamic_shares(recording, run, 3);
  EXPECT_GT(shares.on_mover, 0.8);
  EXPECT_LT(shares.elsewhere, 0.03);
  EXPECT_EQ(run.outcome.statistics.masks_failed, 0);
  // Two frames late, so the last two never arrive; but the first is there at once.
  EXPECT_EQ(run.outcome.statistics.masks_used, static_cast<int>(recording.frames.size()) - 2);
}

TEST(Accuracy, PeopleWhoLeadTheBaseAstrayDoNotLeadTheWholeSystemAstray) {
  const Recording recording = record("crowd", small(5.5));
  const Trial base = run_offline(small_config(DynamicMode::kOff), recording);
  const Trial full = run_offline(small_config(DynamicMode::kFull), recording,
                                 std::make_unique<TruthSegmenter>(recording));
  EXPECT_EQ(lost_frames(full), 0);
  const double full_m = ate_rmse_m(recording, full.trajectory());
  EXPECT_LT(full_m, 0.025);
  EXPECT_LT(full_m, 0.4 * ate_rmse_m(recording, base.trajectory()));
}

}  // namespace
}  // namespace ygslam::system_test
