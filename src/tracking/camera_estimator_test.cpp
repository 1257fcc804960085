#include "tracking/camera_estimator.hpp"

#include <gtest/gtest.h>

#include "tracking/waving_test_world.hpp"

namespace ygslam {
namespace {

using tracking_test::Waving;

std::optional<CameraEstimator::Estimate> estimate(Waving& waving, const CameraConfig& used,
                                                  std::vector<CameraParameter> parameters,
                                                  int frames = 240) {
  const Camera camera(used);
  CameraEstimator estimator(camera, std::move(parameters));
  LocalViewPtr view;
  for (int i = 0; i < frames; ++i) {
    const double t_s = i * Waving::kFrame_s;
    if (i % 20 == 0) view = waving.view(t_s);
    estimator.add(waving.frame(t_s, view));
  }
  return estimator.estimate();
}

TEST(CameraEstimator, FindsTheReadOutTimeOfEitherDirectionAndNoneOfAGlobalShutter) {
  for (const double readout_s : {0.026, -0.018, 0.0}) {
    Waving waving(Waving::camera(), {readout_s, readout_s, 0}, 0.3);
    const auto found = estimate(waving, Waving::camera(), {CameraParameter::kReadout});
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->value[0], readout_s, 0.0007) << readout_s;
    EXPECT_LT(found->std[0], 0.0005);
    EXPECT_LT(std::abs(found->value[0] - readout_s), 5 * found->std[0] + 1e-4);
  }
}

TEST(CameraEstimator, TellsIntrinsicsFromTheReadOut) {
  CameraConfig truth = Waving::camera();
  truth.fx = truth.fy = 1.02 * 525;
  truth.cx += 4;
  truth.cy -= 3;
  Waving waving(truth, {0.02, 0.02, 0}, 0.3);
  const auto found = estimate(waving, Waving::camera(),
                              {CameraParameter::kReadout, CameraParameter::kFocalLength,
                               CameraParameter::kCentreX, CameraParameter::kCentreY});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->value[0], 0.02, 0.001);
  EXPECT_NEAR(found->value[1], 0.02, 0.004);
  EXPECT_NEAR(found->value[2], 4, 1);
  EXPECT_NEAR(found->value[3], -3, 1);
}

TEST(CameraEstimator, NoiseShowsInTheStandardDeviation) {
  Waving clean(Waving::camera(), {0.026, 0.026, 0}, 0.1);
  Waving noisy(Waving::camera(), {0.026, 0.026, 0}, 1.5);
  const auto few = estimate(clean, Waving::camera(), {CameraParameter::kReadout});
  const auto much = estimate(noisy, Waving::camera(), {CameraParameter::kReadout});
  ASSERT_TRUE(few && much);
  EXPECT_GT(much->std[0], 2 * few->std[0]);
}

TEST(CameraEstimator, NoLongerRecordingTakesAwayWhatDoesNotAverageOut) {
  Waving waving(Waving::camera(), {0.026, 0.026, 0}, 0.3);
  const auto brief = estimate(waving, Waving::camera(), {CameraParameter::kReadout}, 240);
  const auto lengthy = estimate(waving, Waving::camera(), {CameraParameter::kReadout}, 960);
  ASSERT_TRUE(brief && lengthy);
  EXPECT_GT(brief->systematic[0], 0);
  EXPECT_NEAR(lengthy->systematic[0], brief->systematic[0], 0.3 * brief->systematic[0]);
  EXPECT_LT(lengthy->std[0], 0.7 * brief->std[0]);
}

TEST(CameraEstimator, SaysNothingOfAShortOrAStillRecordingAndForgets) {
  Waving waving(Waving::camera(), {0.026, 0.026, 0}, 0.3);
  EXPECT_FALSE(estimate(waving, Waving::camera(), {CameraParameter::kReadout}, 30));
  const Camera camera(Waving::camera());
  CameraEstimator still(camera, {CameraParameter::kReadout});
  const LocalViewPtr view = waving.view(0);
  for (int i = 0; i < 300; ++i) {
    TrackedFrame frame = waving.frame(0, view);
    auto later = std::make_shared<RgbdFrame>();
    later->stamp = {to_ns(100 + i * Waving::kFrame_s)};
    frame.seen.frame = later;
    frame.seen.read_out.body_velocity = Vec6::Constant(1e-3);
    still.add(frame);
  }
  EXPECT_FALSE(still.estimate());
}

TEST(CameraEstimator, MemoryDoesNotGrowWithTheRun) {
  // Parts grow longer once there are many: the estimate of a long run is as good.
  Waving waving(Waving::camera(), {0.026, 0.026, 0}, 0.3);
  const auto found = estimate(waving, Waving::camera(), {CameraParameter::kReadout}, 2400);
  ASSERT_TRUE(found);
  EXPECT_LE(found->parts, 64);
  EXPECT_NEAR(found->value[0], 0.026, 0.0005);
}

}  // namespace
}  // namespace ygslam
