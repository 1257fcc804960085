// The mesh of a room with a table.
#pragma once

#include <cmath>

#include "scene/scene.hpp"

namespace ygslam::room_test {

/// A rectangle of small triangles: from corner along a and b, which a x b looks out of.
inline void add_rectangle(TriangleMesh& mesh, const SE3& T_world_room, const Vec3& corner,
                          const Vec3& a, const Vec3& b) {
  constexpr double kStep_m = 0.05;
  const int across = static_cast<int>(std::lround(a.norm() / kStep_m));
  const int along = static_cast<int>(std::lround(b.norm() / kStep_m));
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (int j = 0; j <= along; ++j) {
    for (int i = 0; i <= across; ++i) {
      SurfacePoint vertex;
      vertex.p_world = (T_world_room * (corner + a * i / across + b * j / along)).cast<float>();
      vertex.normal_world = (T_world_room.R() * a.cross(b).normalized()).cast<float>();
      mesh.vertices.push_back(vertex);
    }
  }
  const auto at = [&](int i, int j) {
    return first + static_cast<std::uint32_t>(j * (across + 1) + i);
  };
  for (int j = 0; j < along; ++j) {
    for (int i = 0; i < across; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
      mesh.triangles.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
}

/// 4 m x 3 m x 2.5 m, its floor at z = 0, with a table of .75 m; seen from inside.
inline TriangleMesh room(const SE3& T_world_room) {
  TriangleMesh mesh;
  const auto add = [&](const Vec3& corner, const Vec3& a, const Vec3& b) {
    add_rectangle(mesh, T_world_room, corner, a, b);
  };
  add({0, 0, 0}, {4, 0, 0}, {0, 3, 0});       // floor
  add({0, 0, 2.5}, {0, 3, 0}, {4, 0, 0});     // ceiling
  add({0, 0, 0}, {0, 0, 2.5}, {4, 0, 0});     // wall y = 0
  add({0, 0, 0}, {0, 3, 0}, {0, 0, 2.5});     // wall x = 0
  add({1, 1, 0.75}, {1.5, 0, 0}, {0, 1, 0});  // table
  return mesh;
}

}  // namespace ygslam::room_test
