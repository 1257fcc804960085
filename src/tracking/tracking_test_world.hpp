// A painted wall before a camera that slides along it, and a map of one page that stands in for the
// mapper: what the tests of the tracker's states need, in a few milliseconds a frame.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "core/rng.hpp"
#include "features/orb.hpp"
#include "geometry/geometry_testing.hpp"
#include "map/local_view.hpp"
#include "map/messages.hpp"
#include "motion/classification/point_classifier.hpp"

namespace ygslam::tracking_test {

/// Blocks of random brightness.
class PaintedWall {
 public:
  static constexpr int kWidth_px = 320;
  static constexpr int kHeight_px = 240;
  static constexpr double kFocal_px = 260;
  static constexpr double kDistance_m = 2.0;
  static constexpr double kFrame_s = 0.05;
  /// How far the camera has moved along the wall where the image has moved by so many pixels.
  static constexpr double metres(double px) { return px * kDistance_m / kFocal_px; }
  /// Its shutter is known to be global: else the first keyframe waits for the second frame.
  [[nodiscard]] static CameraConfig camera() {
    CameraConfig config = geometry_test::test_camera(kFocal_px, kWidth_px, kHeight_px).config();
    config.shutter_known = true;
    return config;
  }

  explicit PaintedWall(std::uint64_t seed) : brightness_(kColumns * kRows) {
    Rng rng(seed);
    for (auto& grey : brightness_) grey = static_cast<std::uint8_t>(rng.below(256));
  }

  struct View {
    int left_px = 0;              ///< where the camera stands along the wall
    float depth_m = kDistance_m;  ///< of all pixels
    int painted_px = kWidth_px;   ///< columns from the left; the rest of the image is grey
    int measured_px = kWidth_px;  ///< columns with depth
  };
  /// @param number of the frame, which is its time, too.
  [[nodiscard]] FramePtr see(int number, const View& view) const {
    auto frame = std::make_shared<RgbdFrame>();
    frame->id = FrameId{static_cast<std::uint32_t>(number)};
    frame->stamp = {to_ns(100 + number * kFrame_s)};
    frame->grey = GreyImage(kWidth_px, kHeight_px, 120);
    frame->colour = ColourImage(kWidth_px, kHeight_px);
    frame->depth_m = DepthImage(kWidth_px, kHeight_px);
    for (int v = 0; v < kHeight_px; ++v) {
      for (int u = 0; u < view.painted_px; ++u) frame->grey.at(u, v) = at(u + view.left_px, v);
      for (int u = 0; u < view.measured_px; ++u) frame->depth_m.at(u, v) = view.depth_m;
    }
    return frame;
  }

 private:
  static constexpr int kBlock_px = 12;
  static constexpr int kColumns = 200;
  static constexpr int kRows = kHeight_px / kBlock_px;
  [[nodiscard]] std::uint8_t at(int u, int v) const {
    return brightness_[static_cast<std::size_t>(u / kBlock_px % kColumns * kRows + v / kBlock_px)];
  }

  std::vector<std::uint8_t> brightness_;
};

inline OrbConfig few_features() {
  OrbConfig config;
  config.features = 500;
  return config;
}
inline DynamicConfig dynamics_off() {
  DynamicConfig config;
  config.mode = DynamicMode::kOff;
  return config;
}

/// Every candidate becomes a keyframe, and every feature of it with depth a landmark of its own.
/// The view is of the newest one; the others' poses are in it.
class OnePageMap {
 public:
  explicit OnePageMap(const Camera& camera) : camera_(camera) {}

  void insert(const KeyframeCandidate& candidate) {
    auto next = std::make_shared<LocalView>();
    next->map_version = view_->map_version + 1;
    next->placed = !candidate.submap_reach_m && view_->placed;
    next->origin = KeyframeId{0};
    next->others = view_->others;
    const KeyframeId id{static_cast<std::uint32_t>(next->others.size())};
    ViewKeyframe keyframe;
    keyframe.T_camera_world = view_->empty() ? candidate.pose.T_camera_reference
                                             : candidate.pose.T_camera_reference *
                                                   view_->pose_of(candidate.pose.reference).value();
    next->others.push_back({id, keyframe.T_camera_world});
    auto data = std::make_shared<KeyframeData>();
    data->id = id;
    data->frame = candidate.frame->id;
    data->stamp = candidate.frame->stamp;
    data->features = candidate.features;
    data->grid = FeatureGrid(*candidate.features, camera_.ideal_bounds());
    data->free_space = FreeSpaceImage(candidate.frame->depth_m);
    data->read_out = candidate.read_out;
    keyframe.data = std::move(data);
    for (std::size_t i = 0; i < candidate.features->size(); ++i)
      keyframe.landmarks.push_back(add_landmark(*candidate.features, i, keyframe, *next));
    keyframe.tracked_landmarks = static_cast<int>(next->landmarks.size());
    next->keyframes.push_back(std::move(keyframe));
    view_ = std::move(next);
  }

  [[nodiscard]] const LocalViewPtr& view() const { return view_; }

 private:
  /// @return its index in the view, -1 of a feature without depth.
  [[nodiscard]] std::int32_t add_landmark(const Features& features, std::size_t i,
                                          const ViewKeyframe& keyframe, LocalView& view) {
    constexpr double kScale = 1.2;
    constexpr int kTopLevel = 7;
    const Feature& feature = features.points[i];
    if (feature.depth_m <= 0) return -1;
    const SE3 T_world_camera = keyframe.T_camera_world.inverse();
    ViewLandmark landmark;
    landmark.id = LandmarkId{next_landmark_++};
    landmark.p_world =
        T_world_camera * camera_.unproject(feature.ideal_px.cast<double>(), feature.depth_m);
    const Vec3 ray = landmark.p_world - T_world_camera.t();
    landmark.normal_world = ray.normalized();
    landmark.descriptor = features.descriptors[i];
    landmark.max_distance_m = ray.norm() * std::pow(kScale, feature.octave);
    landmark.min_distance_m = landmark.max_distance_m / std::pow(kScale, kTopLevel);
    const auto index = static_cast<std::uint32_t>(view.landmarks.size());
    view.landmark_index[landmark.id] = index;
    view.landmarks.push_back(landmark);
    return static_cast<std::int32_t>(index);
  }

  const Camera& camera_;
  std::uint32_t next_landmark_ = 0;
  LocalViewPtr view_ = std::make_shared<const LocalView>();
};

}  // namespace ygslam::tracking_test
