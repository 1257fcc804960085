// A world of points with descriptors, and what cameras see of it: the oracle of the tests of map,
// mapping and tracking.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "core/rng.hpp"
#include "features/feature.hpp"
#include "features/feature_grid.hpp"
#include "geometry/camera.hpp"
#include "geometry/geometry_testing.hpp"
#include "geometry/random_vector.hpp"
#include "image/rgbd_frame.hpp"
#include "map/map.hpp"
#include "map/messages.hpp"

namespace ygslam::map_test {

constexpr int kLevels = 8;
constexpr double kScale = 1.2;

inline Camera camera() { return geometry_test::test_camera(); }

inline Descriptor random_descriptor(Rng& rng) {
  Descriptor d;
  for (auto& bits : d.bits) bits = rng.next();
  return d;
}

/// The descriptor with some of its bits turned over.
inline Descriptor blurred(Descriptor d, int bits, Rng& rng) {
  for (int i = 0; i < bits; ++i) d.bits[rng.below(4)] ^= 1ULL << rng.below(64);
  return d;
}

struct WorldPoint {
  Vec3 p_world;
  Descriptor descriptor;
  double size_m = 0;  ///< decides the pyramid level at which it is seen
  float angle_rad = 0;
};

struct ViewQuality {
  double noise_px = 0.0;
  double depth_share = 1.0;  ///< of the features that have a depth
  int blurred_bits = 6;
};

struct SeenFrame {
  FramePtr frame;
  FeaturesPtr features;
  FeatureGrid grid;
  std::vector<int> point;  ///< per feature: which point of the world it shows
  SE3 T_camera_world;
};

/// Points on the walls of a room around the z axis of the first camera, 1.5 to 5 m away.
class World {
 public:
  World(int points, std::uint64_t seed) : rng_(seed), camera_(map_test::camera()) {
    for (int i = 0; i < points; ++i) {
      const Vec3 p = random_in_box<3>(rng_, {-2.5, -1.5, 1.5}, {2.5, 1.5, 5});
      points_.push_back({p, random_descriptor(rng_), rng_.uniform(0.01, 0.03),
                         static_cast<float>(rng_.uniform(0, 2 * std::numbers::pi))});
    }
  }

  [[nodiscard]] const Camera& camera() const { return camera_; }
  [[nodiscard]] const std::vector<WorldPoint>& points() const { return points_; }
  [[nodiscard]] std::vector<WorldPoint>& points() { return points_; }
  [[nodiscard]] Rng& rng() { return rng_; }

  /// Camera pose number i of a gentle walk.
  [[nodiscard]] static SE3 pose(int i) {
    Vec6 twist;
    twist << 0.04 * i, 0.02 * std::sin(0.9 * i), 0.01 * i, 0.004 * i, -0.008 * i,
        0.003 * std::cos(i);
    return SE3::exp(twist);
  }

  [[nodiscard]] SeenFrame see(const SE3& T_camera_world, std::uint32_t frame,
                              const ViewQuality& quality = {}) {
    auto features = std::make_shared<Features>();
    SeenFrame seen;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Vec3 p_camera = T_camera_world * points_[i].p_world;
      if (p_camera.z() < 0.3) continue;
      const Vec2 px = camera_.project(p_camera) + quality.noise_px * random_normals<2>(rng_);
      if (!camera_.contains(px, 16)) continue;
      Feature f;
      f.uv_px = f.ideal_px = px.cast<float>();
      f.depth_m = rng_.uniform() < quality.depth_share ? static_cast<float>(p_camera.z()) : 0.0F;
      f.angle_rad = points_[i].angle_rad;
      const double size_px = points_[i].size_m / p_camera.norm() * camera_.fx();
      const double octave = std::round(std::log(size_px / 1.5) / std::log(kScale));
      f.octave = static_cast<std::uint8_t>(std::clamp(octave, 0.0, kLevels - 1.0));
      features->points.push_back(f);
      features->descriptors.push_back(blurred(points_[i].descriptor, quality.blurred_bits, rng_));
      seen.point.push_back(static_cast<int>(i));
    }
    auto image = std::make_shared<RgbdFrame>();
    image->id = FrameId{frame};
    image->stamp = {static_cast<std::int64_t>(frame) * 33'000'000};
    seen.frame = image;
    seen.features = features;
    seen.grid = FeatureGrid(*features, camera_.ideal_bounds());
    seen.T_camera_world = T_camera_world;
    return seen;
  }

 private:
  Rng rng_;
  Camera camera_;
  std::vector<WorldPoint> points_;
};

/// Adds the frame as a keyframe without landmarks.
inline KeyframeId add_keyframe(Map& map, const SeenFrame& seen, KeyframeId parent,
                               float static_weight = 1.0F) {
  const KeyframeId id = map.next_keyframe_id();
  auto data = std::make_shared<KeyframeData>(
      KeyframeData{id, seen.frame->id, seen.frame->stamp, seen.features, seen.grid});
  map.add_keyframe(std::move(data), seen.T_camera_world, parent,
                   std::vector<float>(seen.features->size(), static_weight));
  return id;
}

/// A map of `keyframes` poses of the walk with every point's landmark at its true place.
struct TrueMap {
  Map map{{kLevels, kScale}};
  std::vector<SeenFrame> seen;
  std::vector<LandmarkId> landmark;  ///< per point of the world, kNoLandmark where nobody saw it
};

inline TrueMap true_map(World& world, int keyframes, const ViewQuality& quality = {}) {
  TrueMap result;
  result.landmark.assign(world.points().size(), kNoLandmark);
  for (int i = 0; i < keyframes; ++i) {
    result.seen.push_back(world.see(World::pose(i), static_cast<std::uint32_t>(10 * i), quality));
    const SeenFrame& seen = result.seen.back();
    const KeyframeId parent = i ? KeyframeId{static_cast<std::uint32_t>(i - 1)} : kNoKeyframe;
    const KeyframeId id = add_keyframe(result.map, seen, parent);
    for (std::uint32_t k = 0; k < seen.point.size(); ++k) {
      LandmarkId& landmark = result.landmark[seen.point[k]];
      if (landmark == kNoLandmark) {
        landmark = result.map.add_landmark(world.points()[seen.point[k]].p_world, id, k);
      } else {
        result.map.add_observation(landmark, id, k);
        result.map.refresh(landmark);
      }
    }
  }
  return result;
}

}  // namespace ygslam::map_test
