// A camera that is waved about before points: the oracle of what is found out about a camera.
#pragma once

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "core/rng.hpp"
#include "geometry/geometry_testing.hpp"
#include "geometry/random_vector.hpp"
#include "tracking/tracked_frame.hpp"

namespace ygslam::tracking_test {

/// A camera that is waved about in front of points, read with the true times.
class Waving {
 public:
  static constexpr double kFrame_s = 1.0 / 30;
  [[nodiscard]] static CameraConfig camera() { return geometry_test::test_camera().config(); }

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
      const Vec2 noise = random_normals<2>(rng_, noise_px_);
      const Vec2 uv_px = shutter.seen_at(camera_, p_middle);
      f.uv_px = f.ideal_px = (uv_px + noise).cast<float>();
      f.depth_m =
          static_cast<float>(shutter.earlier(p_middle, -shutter.colour_time_s(uv_px.y())).z());
      features->points.push_back(f);
    }
    features->descriptors.resize(features->size());
    return features;
  }

  [[nodiscard]] LocalViewPtr view(double t_s) {
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
    return std::make_shared<const LocalView>(std::move(view));
  }

  [[nodiscard]] TrackedFrame frame(double t_s, const LocalViewPtr& view) {
    TrackedFrame tracked;
    tracked.view = view;
    tracked.T_camera_world = T_world_camera(t_s).inverse();
    auto frame = std::make_shared<RgbdFrame>();
    frame->stamp = {to_ns(100 + t_s)};
    tracked.seen.frame = std::move(frame);
    tracked.seen.features = see(t_s);
    tracked.seen.read_out.body_velocity = body_velocity(t_s);
    for (int i = 0; i < kPoints; ++i)
      tracked.landmarks.push_back(LandmarkId{static_cast<std::uint32_t>(i)});
    return tracked;
  }

 private:
  static constexpr int kPoints = 200;
  Camera camera_;
  ShutterTimes times_;
  double noise_px_;
  Rng rng_{7};
  std::vector<Vec3> points_;
};

}  // namespace ygslam::tracking_test
