#include "tracking/camera_estimator.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"
#include "geometry/geometry_testing.hpp"

namespace ygslam {
namespace {

constexpr int kPoints = 200;
constexpr double kFrame_s = 1.0 / 30;

CameraConfig true_camera() { return geometry_test::test_camera().config(); }

/// A camera that is waved about in front of points, read with the true times.
class Waving {
 public:
  Waving(const CameraConfig& truth, const ShutterTimes& times, double noise_px)
      : camera_(truth), times_(times), noise_px_(noise_px) {
    for (int i = 0; i < kPoints; ++i)
      points_.push_back({rng_.uniform(-1.2, 1.2), rng_.uniform(-0.9, 0.9), rng_.uniform(1.5, 3)});
  }

  [[nodiscard]] static SE3 T_world_camera(double t_s) {
    return {so3_exp(0.12 * Vec3(std::sin(5 * t_s), std::sin(4 * t_s + 1), std::sin(3 * t_s))),
            0.05 * Vec3(std::sin(3 * t_s), std::cos(2 * t_s), std::sin(t_s))};
  }
  [[nodiscard]] static Vec6 body_velocity(double t_s) {
    constexpr double kStep_s = 1e-4;
    return (T_world_camera(t_s - kStep_s).inverse() * T_world_camera(t_s + kStep_s)).log() /
           (2 * kStep_s);
  }

  /// Features as a tracker has them that takes the shutter as global.
  [[nodiscard]] std::shared_ptr<Features> see(double t_s) {
    auto features = std::make_shared<Features>();
    const RollingShutter shutter(camera_.height(), {times_, body_velocity(t_s)});
    for (const Vec3& p_world : points_) {
      const Vec3 p_middle = T_world_camera(t_s).inverse() * p_world;
      Feature f;
      const Vec2 noise(rng_.normal(0, noise_px_), rng_.normal(0, noise_px_));
      const Vec2 uv_px = shutter.seen_at(camera_, p_middle);
      f.uv_px = f.ideal_px = (uv_px + noise).cast<float>();
      f.depth_m =
          static_cast<float>(shutter.earlier(p_middle, -shutter.colour_time_s(uv_px.y())).z());
      features->points.push_back(f);
    }
    features->descriptors.resize(features->size());
    return features;
  }

  [[nodiscard]] LocalView view(double t_s) {
    LocalView view;
    ViewKeyframe keyframe;
    keyframe.T_camera_world = T_world_camera(t_s).inverse();
    KeyframeData data;
    data.id = KeyframeId{0};
    data.features = see(t_s);
    data.read_out.body_velocity = body_velocity(t_s);
    keyframe.data = std::make_shared<const KeyframeData>(std::move(data));
    for (int i = 0; i < kPoints; ++i) {
      const LandmarkId id{static_cast<std::uint32_t>(i)};
      ViewLandmark& landmark = view.landmarks.emplace_back();
      landmark.id = id;
      landmark.p_world = points_[static_cast<std::size_t>(i)];
      view.landmark_index[id] = static_cast<std::uint32_t>(i);
      keyframe.landmarks.push_back(i);
    }
    view.keyframes.push_back(std::move(keyframe));
    return view;
  }

  [[nodiscard]] TrackedFrame frame(double t_s) {
    TrackedFrame tracked;
    auto frame = std::make_shared<RgbdFrame>();
    frame->stamp = {to_ns(100 + t_s)};
    tracked.frame = std::move(frame);
    tracked.features = see(t_s);
    tracked.read_out.body_velocity = body_velocity(t_s);
    for (int i = 0; i < kPoints; ++i)
      tracked.landmarks.push_back(LandmarkId{static_cast<std::uint32_t>(i)});
    return tracked;
  }

 private:
  Camera camera_;
  ShutterTimes times_;
  double noise_px_;
  Rng rng_{7};
  std::vector<Vec3> points_;
};

std::optional<CameraEstimator::Estimate> estimate(Waving& waving, const CameraConfig& used,
                                                  std::vector<CameraParameter> parameters,
                                                  int frames = 240) {
  const Camera camera(used);
  CameraEstimator estimator(camera, std::move(parameters));
  LocalView view;
  for (int i = 0; i < frames; ++i) {
    const double t_s = i * kFrame_s;
    if (i % 20 == 0) view = waving.view(t_s);
    estimator.add(waving.frame(t_s), Waving::T_world_camera(t_s).inverse(), view);
  }
  return estimator.estimate();
}

TEST(CameraEstimator, FindsTheReadOutTimeOfEitherDirectionAndNoneOfAGlobalShutter) {
  for (const double readout_s : {0.026, -0.018, 0.0}) {
    Waving waving(true_camera(), {readout_s, readout_s, 0}, 0.3);
    const auto found = estimate(waving, true_camera(), {CameraParameter::kReadout});
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->value[0], readout_s, 0.0007) << readout_s;
    EXPECT_LT(found->std[0], 0.0005);
    EXPECT_LT(std::abs(found->value[0] - readout_s), 5 * found->std[0] + 1e-4);
  }
}

TEST(CameraEstimator, TellsIntrinsicsFromTheReadOut) {
  CameraConfig truth = true_camera();
  truth.fx = truth.fy = 1.02 * 525;
  truth.cx += 4;
  truth.cy -= 3;
  Waving waving(truth, {0.02, 0.02, 0}, 0.3);
  const auto found = estimate(waving, true_camera(),
                              {CameraParameter::kReadout, CameraParameter::kFocalLength,
                               CameraParameter::kCentreX, CameraParameter::kCentreY});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->value[0], 0.02, 0.001);
  EXPECT_NEAR(found->value[1], 0.02, 0.004);
  EXPECT_NEAR(found->value[2], 4, 1);
  EXPECT_NEAR(found->value[3], -3, 1);
}

TEST(CameraEstimator, NoiseShowsInTheStandardDeviation) {
  Waving clean(true_camera(), {0.026, 0.026, 0}, 0.1);
  Waving noisy(true_camera(), {0.026, 0.026, 0}, 1.5);
  const auto few = estimate(clean, true_camera(), {CameraParameter::kReadout});
  const auto much = estimate(noisy, true_camera(), {CameraParameter::kReadout});
  ASSERT_TRUE(few && much);
  EXPECT_GT(much->std[0], 2 * few->std[0]);
}

TEST(CameraEstimator, SaysNothingOfAShortOrAStillRecordingAndForgets) {
  Waving waving(true_camera(), {0.026, 0.026, 0}, 0.3);
  EXPECT_FALSE(estimate(waving, true_camera(), {CameraParameter::kReadout}, 30));
  const Camera camera(true_camera());
  CameraEstimator still(camera, {CameraParameter::kReadout});
  const LocalView view = waving.view(0);
  for (int i = 0; i < 300; ++i) {
    TrackedFrame frame = waving.frame(0);
    auto later = std::make_shared<RgbdFrame>();
    later->stamp = {to_ns(100 + i * kFrame_s)};
    frame.frame = later;
    frame.read_out.body_velocity = Vec6::Constant(1e-3);
    still.add(frame, Waving::T_world_camera(0).inverse(), view);
  }
  EXPECT_FALSE(still.estimate());
}

TEST(CameraEstimator, MemoryDoesNotGrowWithTheRun) {
  // Parts grow longer once there are many: the estimate of a long run is as good.
  Waving waving(true_camera(), {0.026, 0.026, 0}, 0.3);
  const auto found = estimate(waving, true_camera(), {CameraParameter::kReadout}, 2400);
  ASSERT_TRUE(found);
  EXPECT_LE(found->parts, 64);
  EXPECT_NEAR(found->value[0], 0.026, 0.0005);
}

}  // namespace
}  // namespace ygslam
