#include "tracking/shutter_watch.hpp"

#include <gtest/gtest.h>

#include "tracking/waving_test_world.hpp"

namespace ygslam {
namespace {

using tracking_test::Waving;

constexpr double kTrue_s = 0.02;

/// A camera as its file has it, which reads its rows in another time.
struct Watched {
  Watched(double file_s, bool known, double true_s = kTrue_s)
      : Watched(config(file_s, known), true_s) {}
  Watched(const CameraConfig& file, double true_s)
      : camera(file), waving(Waving::camera(), {true_s, true_s, 0}, 0.3) {}
  /// What is reported on the way.
  std::vector<ShutterReport> wave(double seconds) {
    std::vector<ShutterReport> reports;
    LocalViewPtr view;
    for (int i = 0; i * Waving::kFrame_s < seconds; ++i) {
      const double t_s = i * Waving::kFrame_s;
      if (i % 20 == 0) view = waving.view(t_s);
      if (const auto report = watch.step(waving.frame(t_s, view))) reports.push_back(*report);
    }
    return reports;
  }
  static CameraConfig config(double file_s, bool known) {
    CameraConfig config = Waving::camera();
    config.colour_readout_ms = config.depth_readout_ms = 1e3 * file_s;
    config.shutter_known = known;
    return config;
  }

  Camera camera;
  Waving waving;
  ShutterWatch watch{camera};
};

TEST(ShutterWatch, OfACameraNobodyKnowsWhatIsSeenIsTakenOver) {
  Watched unknown(0, false);
  EXPECT_TRUE(unknown.watch.may_roll());
  EXPECT_TRUE(unknown.wave(2.5).empty()) << "too little to go by";
  EXPECT_TRUE(unknown.watch.times().is_global());
  const auto reports = unknown.wave(5);
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_TRUE(reports.front().taken_over);
  EXPECT_EQ(reports.front().in_use_s, 0);
  EXPECT_NEAR(reports.front().readout_s, kTrue_s, 0.001);
  EXPECT_LT(reports.front().std_s, 0.0015);
  EXPECT_EQ(unknown.watch.times().colour_readout_s, reports.front().readout_s);
  EXPECT_EQ(unknown.watch.times().depth_readout_s, reports.front().readout_s);
  EXPECT_FALSE(unknown.watch.known());
  EXPECT_TRUE(unknown.wave(8).empty()) << "nothing new";
}

TEST(ShutterWatch, OnceTheRowsRollTheSuspectedDeviceIsTakenAndThenItsOwnTimes) {
  CameraConfig config = Watched::config(0, false);
  config.suspected_colour_readout_ms = 26;
  config.suspected_depth_readout_ms = 34;
  const auto times_after = [&](double true_s) {
    std::vector<ShutterTimes> found;
    for (const ShutterReport& report : Watched(config, true_s).wave(16))
      found.push_back(report.times);
    return found;
  };
  const auto alike = times_after(0.0262);
  ASSERT_FALSE(alike.empty());
  EXPECT_DOUBLE_EQ(alike.front().colour_readout_s, 0.026);
  EXPECT_DOUBLE_EQ(alike.front().depth_readout_s, 0.034);
  const auto unlike = times_after(0.008);
  ASSERT_FALSE(unlike.empty());
  EXPECT_NEAR(unlike.front().colour_readout_s, 0.008, 0.002) << "no such device";
  EXPECT_TRUE(times_after(0).empty());
}

TEST(ShutterWatch, WhatIsKnownOfARelativeStartsAnEstimate) {
  CameraConfig config = Watched::config(0.026, false);
  config.depth_readout_ms = 34;
  const auto reports = Watched(config, 0.015).wave(8);
  ASSERT_FALSE(reports.empty());
  const ShutterTimes& times = reports.back().times;
  EXPECT_NEAR(times.depth_readout_s - times.colour_readout_s, 0.008, 1e-9);
  EXPECT_LT(times.colour_readout_s, 0.02);
}

TEST(ShutterWatch, OfAnUnknownGlobalShutterThereIsNothingToReport) {
  Watched global(0, false, 0);
  EXPECT_TRUE(global.wave(8).empty());
  EXPECT_TRUE(global.watch.times().is_global());
}

TEST(ShutterWatch, TheFileIsBelievedAndContradictedOnce) {
  Watched wrong(0.01, true);
  const auto reports = wrong.wave(12);
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_FALSE(reports.front().taken_over);
  EXPECT_EQ(reports.front().in_use_s, 0.01);
  EXPECT_NEAR(reports.front().readout_s, kTrue_s, 0.001);
  EXPECT_EQ(wrong.watch.times().colour_readout_s, 0.01);
}

TEST(ShutterWatch, AFileThatIsRightOrAlmostIsLeftInPeace) {
  EXPECT_TRUE(Watched(kTrue_s, true).wave(8).empty());
  EXPECT_TRUE(Watched(kTrue_s + 0.002, true).wave(8).empty());
}

TEST(ShutterWatch, OnlyAKnownGlobalShutterCannotRoll) {
  EXPECT_FALSE(Watched(0, true).watch.may_roll());
  EXPECT_TRUE(Watched(0.01, true).watch.may_roll());
  EXPECT_TRUE(Watched(0, false).watch.may_roll());
}

}  // namespace
}  // namespace ygslam
