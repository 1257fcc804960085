// A room with objects in it, as keyframes with perfect masks show it.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>

#include "dense/scene_naming/named_scene.hpp"
#include "volume/volume_test_world.hpp"

namespace ygslam::object_test {

using volume_test::look_at;
using volume_test::World;

// Masks end a pixel inside the edges (2 cm, more on a flat face), voxels round them.
inline constexpr double kBoxTolerance_m = 0.08;
inline constexpr SemanticClass kChair = coco_class(56), kScreen = coco_class(62),
                               kDog = coco_class(16);

inline Camera room_camera() {
  CameraConfig c;
  c.fx = c.fy = 150, c.cx = 95.5, c.cy = 71.5, c.width = 192, c.height = 144;
  return Camera(c);
}

inline DenseMapConfig room_config() { return {}; }

/// A room with its floor at y = 1.2 m and two boxes on it; their numbers are what `detections`
/// says.
inline World two_boxes() {
  World world;
  world.low = Vec3(-2, -1.3, -2);
  world.high = Vec3(2, 1.2, 2);
  world.cuboids = {{Vec3(-0.8, 0.7, -0.3), Vec3(-0.3, 1.2, 0.4), SceneObjectId{1}, {200, 40, 40}},
                   {Vec3(0.4, 0.4, -0.2), Vec3(1.0, 1.2, 0.1), SceneObjectId{2}, {40, 40, 200}}};
  return world;
}

/// A view of it, with perfect masks.
inline DenseFrame keyframe_of(const World& world, const Camera& camera, std::uint32_t id,
                              const SE3& T_world_camera, std::vector<Detection> detections,
                              std::optional<Timestamp> stamp = {}) {
  auto frame = std::make_shared<RgbdFrame>();
  frame->id = FrameId{id};
  frame->stamp = stamp.value_or(Timestamp{1000 + id});
  frame->colour = ColourImage(camera.width(), camera.height());
  frame->depth_m = DepthImage(camera.width(), camera.height());
  DenseFrame keyframe{
      KeyframeId{id},       frame, {}, {}, GreyImage(camera.width(), camera.height()),
      std::move(detections)};
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const Vec3 ray = camera.unproject({u, v}, 1.0);
      const auto seen = world.look(T_world_camera.t(), T_world_camera.R() * ray);
      frame->depth_m.at(u, v) = static_cast<float>(seen.distance_m);
      frame->colour.at(u, v) = seen.colour;
      keyframe.things.at(u, v) = static_cast<std::uint8_t>(seen.object);
    }
  }
  return keyframe;
}

inline SE3 view_pose(std::uint32_t i) {
  const double angle = -0.9 + 0.3 * i;
  return look_at(Vec3(1.7 * std::sin(angle), -0.5, -1.7 * std::cos(angle)), Vec3(0.1, 0.7, 0));
}

/// Seven views from one side to the other; in two of them the chair is taken for a couch.
inline DenseUpdate seven_views(const Camera& camera, const World& world) {
  DenseUpdate update;
  for (std::uint32_t i = 0; i < 7; ++i) {
    const Detection first{i == 1 || i == 4 ? coco_class(57) : kChair, 0.8F};
    update.added.push_back(keyframe_of(world, camera, i, view_pose(i), {first, {kScreen, 0.6F}}));
    update.T_world_camera[KeyframeId{i}] = view_pose(i);
  }
  return update;
}

/// Corners of the box are those of the cuboid, whatever its axes are called.
inline void expect_box(const SceneObject& object, const volume_test::Cuboid& truth,
                       double tolerance_m) {
  Vec3 low = Vec3::Constant(1e9), high = -low;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 side((corner & 1) - 0.5, (corner >> 1 & 1) - 0.5, (corner >> 2) - 0.5);
    const Vec3 p = object.box.T_world_box * side.cwiseProduct(object.box.size_m);
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  EXPECT_LT((low - truth.low).cwiseAbs().maxCoeff(), tolerance_m) << low.transpose();
  EXPECT_LT((high - truth.high).cwiseAbs().maxCoeff(), tolerance_m) << high.transpose();
}

inline StaticScene scene_of(const DenseUpdate& update, const Camera& camera) {
  DenseMap map(room_config(), camera);
  map.apply(update);
  map.finish();
  return named_scene(map);
}

}  // namespace ygslam::object_test
