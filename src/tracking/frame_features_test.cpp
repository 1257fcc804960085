#include "tracking/frame_features.hpp"

#include <gtest/gtest.h>

#include "tracking/tracking_test_world.hpp"

namespace ygslam {
namespace {

using tracking_test::PaintedWall;

constexpr ShutterTimes kRolling{.colour_readout_s = 0.02, .depth_readout_s = 0.02};

struct Seen {
  Camera camera{PaintedWall::camera()};
  FrameFeatures features;
  explicit Seen(const PaintedWall::View& view = {}) {
    OrbExtractor orb{OrbConfig{}};
    features = extract_features(orb, camera, PaintedWall(3).see(1, view));
  }
};

Vec6 sideways(double mps) { return Vec6::Unit(0) * mps; }

float largest_shift_px(const FrameFeatures& a, const FrameFeatures& b) {
  float shift_px = 0;
  for (std::size_t i = 0; i < a.features->size(); ++i)
    shift_px = std::max(shift_px,
                        (a.features->points[i].ideal_px - b.features->points[i].ideal_px).norm());
  return shift_px;
}

TEST(FrameFeatures, AreExtractedWithDepthWhereItIs) {
  constexpr int kMeasured_px = PaintedWall::kWidth_px / 2;
  const Seen seen({.measured_px = kMeasured_px});
  ASSERT_GT(seen.features.features->size(), 300U);
  EXPECT_EQ(seen.features.grid.size(), seen.features.features->size());
  EXPECT_EQ(seen.features.frame->id, FrameId{1});
  for (const Feature& f : seen.features.features->points) {
    if (f.uv_px.x() < kMeasured_px - 2) {
      EXPECT_NEAR(f.depth_m, PaintedWall::kDistance_m, 1e-5);
    } else if (f.uv_px.x() > kMeasured_px + 2) {
      EXPECT_EQ(f.depth_m, 0);
    }
  }
}

TEST(FrameFeatures, UsableAreThoseWithDepthAndWeight) {
  Seen seen({.measured_px = PaintedWall::kWidth_px / 2});
  FrameFeatures& features = seen.features;
  const int with_depth = static_cast<int>(std::ranges::count_if(
      features.features->points, [](const Feature& f) { return f.depth_m > 0; }));
  features.static_weight.assign(features.features->size(), 0.5F);
  EXPECT_EQ(features.usable_points(0.5F), with_depth);
  EXPECT_EQ(features.usable_points(0.51F), 0);
  const auto first = std::ranges::find_if(features.features->points,
                                          [](const Feature& f) { return f.depth_m > 0; });
  features.static_weight[static_cast<std::size_t>(first - features.features->points.begin())] = 0;
  EXPECT_EQ(features.usable_points(0.5F), with_depth - 1);
}

TEST(ShutterCorrected, AGlobalShuttersFeaturesStayAndTheVelocityIsKept) {
  const Seen seen;
  const FrameFeatures same = shutter_corrected(seen.features, seen.camera, {}, sideways(1));
  EXPECT_EQ(same.features, seen.features.features);
  EXPECT_EQ(same.read_out.body_velocity, sideways(1));
}

TEST(ShutterCorrected, RowsReadEarlyAndLateMoveApart) {
  const Seen seen;
  const FrameFeatures now = shutter_corrected(seen.features, seen.camera, kRolling, sideways(1));
  EXPECT_NE(now.features, seen.features.features);
  const double rows_px =
      kRolling.colour_readout_s * PaintedWall::kFocal_px / PaintedWall::kDistance_m;
  for (std::size_t i = 0; i < now.features->size(); ++i) {
    const Feature& was = seen.features.features->points[i];
    const double share = (was.uv_px.y() + 0.5) / PaintedWall::kHeight_px - 0.5;
    EXPECT_NEAR(now.features->points[i].ideal_px.x() - was.ideal_px.x(), share * rows_px, 1e-3);
    EXPECT_EQ(now.features->points[i].uv_px, was.uv_px);
  }
  // The grid goes along.
  std::vector<std::uint32_t> found;
  now.grid.in_radius(now.features->points[0].ideal_px, 0.01F, 0, 7, found);
  EXPECT_FALSE(found.empty());
}

TEST(ShutterCorrected, HoweverItWasCorrectedBefore) {
  const Seen seen;
  const FrameFeatures once = shutter_corrected(seen.features, seen.camera, kRolling, sideways(0.4));
  const FrameFeatures other = shutter_corrected(seen.features, seen.camera, kRolling, sideways(-2));
  const FrameFeatures twice = shutter_corrected(other, seen.camera, kRolling, sideways(0.4));
  EXPECT_GT(largest_shift_px(once, other), 1);
  EXPECT_EQ(largest_shift_px(once, twice), 0);
  const FrameFeatures back = shutter_corrected(other, seen.camera, kRolling, Vec6::Zero());
  EXPECT_LT(largest_shift_px(back, seen.features), 1e-3);
}

TEST(ShutterCorrected, TheDelayOfAFramesOwnDepthIsAddedToTheCameras) {
  Seen seen;
  auto late = std::make_shared<RgbdFrame>(*seen.features.frame);
  late->depth_delay_s = 0.004;
  seen.features.frame = late;
  ShutterTimes times = kRolling;
  times.depth_delay_s = 0.01;
  EXPECT_DOUBLE_EQ(shutter_corrected(seen.features, seen.camera, times, sideways(1))
                       .read_out.times.depth_delay_s,
                   0.014);
}

}  // namespace
}  // namespace ygslam
