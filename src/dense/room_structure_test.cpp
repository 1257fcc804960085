#include "dense/room_structure.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace ygslam {
namespace {

/// A rectangle of small triangles: from corner along a and b, which a x b looks out of.
void add_rectangle(TriangleMesh& mesh, const SE3& T_world_room, const Vec3& corner, const Vec3& a,
                   const Vec3& b) {
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
TriangleMesh room(const SE3& T_world_room) {
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

class Room : public ::testing::TestWithParam<double> {
 protected:
  /// As a camera sees it that is not held upright.
  SE3 T_world_room_{so3_exp(Vec3(-1.4 + GetParam(), 0.5, 0.3 * GetParam())), Vec3(0.4, 1.2, -0.7)};
  TriangleMesh mesh_ = room(T_world_room_);
  Vec3 up_ = T_world_room_.R().col(2);
};

TEST_P(Room, UpAndTheFloorAreFoundFromARoughGuess) {
  const Vec3 guess = so3_exp(Vec3(0.2, -0.25, 0.1)) * up_;
  const Gravity gravity = find_gravity(mesh_, guess, T_world_room_ * Vec3(2, 1, 1.5));
  EXPECT_LT(std::acos(std::min(1.0, gravity.up_world.dot(up_))), 0.01);
  EXPECT_NEAR(gravity.floor_m, (T_world_room_ * Vec3(0, 0, 0)).dot(gravity.up_world), 0.02);
}

TEST_P(Room, FloorWallsAndCeilingAreNamedAndNothingElse) {
  const Gravity gravity{up_, T_world_room_.t().dot(up_)};
  mesh_.vertices.front().label.object = SceneObjectId{3};
  label_structure(mesh_, gravity);
  EXPECT_EQ(mesh_.vertices.front().label.semantic_class, SemanticClass::kUnknown)
      << "the object keeps its own";
  for (std::size_t i = 1; i < mesh_.vertices.size(); ++i) {
    const SurfacePoint& vertex = mesh_.vertices[i];
    const Vec3 p_room = T_world_room_.inverse() * vertex.p_world.cast<double>();
    const Vec3 normal = T_world_room_.R().transpose() * vertex.normal_world.cast<double>();
    SemanticClass expected = SemanticClass::kUnknown;
    if (std::abs(normal.z()) < 0.5) expected = SemanticClass::kWall;
    if (normal.z() > 0.5 && p_room.z() < 0.1) expected = SemanticClass::kFloor;
    if (normal.z() < -0.5) expected = SemanticClass::kCeiling;
    ASSERT_EQ(vertex.label.semantic_class, expected) << p_room.transpose();
    if (expected != SemanticClass::kUnknown) {
      ASSERT_GT(vertex.label.probability, 0.5F);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Orientations, Room, ::testing::Values(-0.4, 0.0, 0.7));

TEST(RoomStructure, OfNothingIsNothing) {
  TriangleMesh nothing;
  const Gravity gravity = find_gravity(nothing, Vec3(0, -1, 0), Vec3::Zero());
  EXPECT_NEAR(gravity.up_world.y(), -1, 1e-12);
  label_structure(nothing, gravity);
}

}  // namespace
}  // namespace ygslam
