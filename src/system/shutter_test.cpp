// What a run makes of a shutter that is known, unknown, or told wrongly.
#include <gtest/gtest.h>

#include "system/testing/rendered_recording.hpp"

namespace ygslam::system_test {
namespace {

constexpr double kReadoutShare = 0.8;
constexpr double kReadout_s = kReadoutShare / 30;

/// A lively recording of an empty room, its camera's file changed.
class LivelyRoom : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    sim::SequenceOptions options = small(8);
    options.fps = 30;
    options.noise = sim::NoiseKind::kKinect;
    options.without_people = options.without_movers = true;
    options.rolling = kReadoutShare;
    recording_ = std::make_unique<Recording>(record("walking_rpy", options));
  }
  static void TearDownTestSuite() { recording_.reset(); }

  static Trial run_with(double readout_ms, bool known) {
    CameraConfig config = recording_->camera.config();
    config.colour_readout_ms = config.depth_readout_ms = readout_ms;
    config.shutter_known = known;
    recording_->camera = Camera(config);
    return run_offline(small_config(DynamicMode::kGeometry), *recording_);
  }
  static std::vector<ShutterReport> reports(const Trial& trial) {
    std::vector<ShutterReport> found;
    for (const TrackResult& result : trial.results)
      if (result.shutter) found.push_back(*result.shutter);
    return found;
  }

  static inline std::unique_ptr<Recording> recording_;
};

TEST_F(LivelyRoom, AnUnknownReadOutIsFoundAndTakenOver) {
  const Trial trial = run_with(0, false);
  const auto found = reports(trial);
  ASSERT_FALSE(found.empty());
  EXPECT_TRUE(found.front().taken_over);
  EXPECT_EQ(found.front().in_use_s, 0);
  EXPECT_NEAR(found.back().readout_s, kReadout_s, 0.003);
}

TEST_F(LivelyRoom, WhatCameBeforeAReadOutWasFoundIsCorrected) {
  const double global_m = ate_rmse_m(*recording_, run_with(0, true).trajectory());
  const double known_m = ate_rmse_m(*recording_, run_with(1e3 * kReadout_s, true).trajectory());
  const double found_m = ate_rmse_m(*recording_, run_with(0, false).trajectory());
  std::printf("as global %.1f mm, found %.1f mm, known %.1f mm\n", 1e3 * global_m, 1e3 * found_m,
              1e3 * known_m);
  EXPECT_LT(found_m, 0.3 * global_m);
  EXPECT_LT(found_m, 1.3 * known_m);
}

TEST_F(LivelyRoom, AKnownOneIsBelievedAndContradictedOnce) {
  EXPECT_TRUE(reports(run_with(1e3 * kReadout_s, true)).empty()) << "it is right";
  const auto found = reports(run_with(10, true));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_FALSE(found.front().taken_over);
  EXPECT_NEAR(found.front().readout_s, kReadout_s, 0.003);
}

TEST_F(LivelyRoom, KnowingItIsWorthMost) {
  const double global_m = ate_rmse_m(*recording_, run_with(0, true).trajectory());
  const double known_m = ate_rmse_m(*recording_, run_with(1e3 * kReadout_s, true).trajectory());
  EXPECT_LT(known_m, 0.4 * global_m);
}

}  // namespace
}  // namespace ygslam::system_test
