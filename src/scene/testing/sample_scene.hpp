// A small furnished room in a world that may stand at any angle.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "core/rng.hpp"
#include "scene/scene.hpp"

namespace ygslam::testing {

/// A thing in the room's own frame: x and y along the walls, z up from the floor [m].
struct SampleBox {
  SurfaceLabel label;
  Rgb8 colour;
  Vec3 low, high;
  [[nodiscard]] bool contains(const Vec3& p) const {
    return (p.array() >= low.array()).all() && (p.array() < high.array()).all();
  }
};

inline constexpr SceneObjectId kSampleChair{3}, kSampleTable{700}, kSampleGone{9};
inline const Vec3 kSampleRoom_m(2.0, 1.5, 2.2);
/// Nobody looked in here.
inline const SampleBox kSampleHidden{{}, {}, Vec3(1.5, 0, -1), Vec3(2, 0.4, 2.2)};

inline std::vector<SampleBox> sample_boxes() {
  const SemanticClass chair = coco_class(56), table = coco_class(60);
  return {
      {{SemanticClass::kFloor, kNoSceneObject, 0.98F}, {150, 120, 90}, {0, 0, -0.1}, {2, 1.5, 0}},
      {{SemanticClass::kWall, kNoSceneObject, 0.9F},
       {220, 215, 200},
       {0, 1.5, -0.1},
       {2, 1.6, 2.2}},
      {{SemanticClass::kCeiling, kNoSceneObject, 0.8F},
       {250, 250, 250},
       {0, 0, 2.2},
       {2, 1.6, 2.3}},
      {{chair, kSampleChair, 0.75F}, {200, 30, 40}, {0.3, 0.2, 0}, {0.7, 0.6, 0.8}},
      {{table, kSampleTable, 0.625F}, {90, 60, 30}, {1.0, 0.8, 0.6}, {1.8, 1.2, 0.7}},
      {{SemanticClass::kUnknown, kNoSceneObject, 0.3F},
       {10, 200, 90},
       {0, 1.2, 0},
       {0.2, 1.5, 0.3}}};
}

struct SampleScene {
  SE3 T_world_room;
  Gravity gravity;
  std::vector<SurfacePoint> cloud;
  TriangleMesh mesh;
  SpaceCells space;
  std::vector<SceneObject> objects;
};

inline void add_box_mesh(const SampleBox& box, const SE3& T_world_room, TriangleMesh& mesh) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool high : {false, true}) {
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      Vec3 normal = Vec3::Zero();
      normal[axis] = high ? 1 : -1;
      for (int corner = 0; corner < 4; ++corner) {
        // Counter-clockwise about the normal.
        const int along = high ? (axis + 1) % 3 : (axis + 2) % 3;
        const int across = high ? (axis + 2) % 3 : (axis + 1) % 3;
        Vec3 p_room;
        p_room[axis] = high ? box.high[axis] : box.low[axis];
        p_room[along] = corner == 1 || corner == 2 ? box.high[along] : box.low[along];
        p_room[across] = corner >= 2 ? box.high[across] : box.low[across];
        mesh.vertices.push_back({(T_world_room * p_room).cast<float>(),
                                 (T_world_room.R() * normal).cast<float>(), box.colour, box.label});
      }
      mesh.triangles.push_back({first, first + 1, first + 2});
      mesh.triangles.push_back({first, first + 2, first + 3});
    }
  }
}

inline SceneObject sample_object(const SampleBox& box, const SE3& T_world_room) {
  SceneObject object;
  object.id = box.label.object;
  object.semantic_class = box.label.semantic_class;
  object.probability = box.label.probability;
  object.state = ObjectState::kStatic;
  object.box = {T_world_room * SE3(Mat3::Identity(), (box.low + box.high) / 2), box.high - box.low};
  object.views = 12;
  object.first_seen = {1'311'868'164'363'181'001};
  object.last_seen = {1'311'868'170'000'000'002};
  return object;
}

inline SpaceCell sample_cell(const Vec3& p_room, Rng& rng) {
  SpaceCell cell;
  if (kSampleHidden.contains(p_room)) return cell;
  const Vec3 above = (kSampleRoom_m - p_room).cwiseMin(p_room);
  if (above.minCoeff() >= 0) cell.state = SpaceState::kFree;
  cell.log_odds = -2 + 0.25F * static_cast<float>(rng.below(4));
  for (const SampleBox& box : sample_boxes()) {
    if (!box.contains(p_room)) continue;
    cell.state = SpaceState::kOccupied;
    cell.log_odds = 3.5F - 0.25F * static_cast<float>(rng.below(4));
    cell.colour = box.colour;
    cell.label = box.label;
  }
  return cell;
}

/// Every cell that is known, and a few that are told to be unknown.
inline SpaceCells sample_space(const SE3& T_world_room, double cell_m) {
  SpaceCells space;
  space.cell_m = cell_m;
  Rng rng(5);
  const SE3 T_room_world = T_world_room.inverse();
  const int reach = static_cast<int>(2 / cell_m);  // farther than any corner of the room
  const Vec3 centre_world = T_world_room * (kSampleRoom_m / 2) / cell_m;
  const Eigen::Vector3i middle = centre_world.array().floor().cast<int>();
  for (int z = -reach; z < reach; ++z) {
    for (int y = -reach; y < reach; ++y) {
      for (int x = -reach; x < reach; ++x) {
        const Eigen::Vector3i index = middle + Eigen::Vector3i(x, y, z);
        const Vec3 p_world = (index.cast<double>().array() + 0.5) * cell_m;
        const Vec3 p_room = T_room_world * p_world;
        SpaceCell cell = sample_cell(p_room, rng);
        if (cell.state == SpaceState::kUnknown && !kSampleHidden.contains(p_room)) continue;
        cell.index = index;
        space.cells.push_back(cell);
      }
    }
  }
  return space;
}

/// @param up_world any direction. @param cell_m of the space.
inline SampleScene sample_scene(const Vec3& up_world, double cell_m = 0.1) {
  SampleScene scene;
  const Mat3 R = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), up_world).toRotationMatrix();
  scene.T_world_room = SE3(R, R * Vec3(-0.8, -0.5, -1.2));
  scene.gravity = {up_world, -1.2};
  for (const SampleBox& box : sample_boxes()) {
    add_box_mesh(box, scene.T_world_room, scene.mesh);
    if (box.label.object != kNoSceneObject)
      scene.objects.push_back(sample_object(box, scene.T_world_room));
  }
  scene.mesh.triangles.push_back(
      {0, 72, 73});  // the chair's, two to one, with a corner of the floor
  SampleBox gone = sample_boxes()[3];
  gone.label.object = kSampleGone;
  scene.objects.push_back(sample_object(gone, scene.T_world_room));
  scene.objects.back().state = ObjectState::kAbsent;
  Rng rng(4);
  for (int i = 0; i < 1000; ++i) {
    SurfacePoint point =
        scene.mesh.vertices[rng.below(static_cast<std::uint32_t>(scene.mesh.vertices.size()))];
    for (int k = 0; k < 3; ++k) point.p_world[k] += static_cast<float>(rng.uniform(-0.1, 0.1));
    point.colour.g = static_cast<std::uint8_t>(rng.below(256));
    scene.cloud.push_back(point);
  }
  scene.space = sample_space(scene.T_world_room, cell_m);
  return scene;
}

}  // namespace ygslam::testing
