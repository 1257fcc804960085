#include "dense/scene_naming/room_structure.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/rng.hpp"
#include "dense/scene_naming/room_test_mesh.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam {
namespace {

using room_test::room;

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

/// A bin of directions is no direction: at 30 m a degree is half a metre.
TEST(RoomStructure, WallsFarFromTheOriginWithNoisyNormalsAreNamedWhole) {
  for (const double yaw : {0.0, 0.0436, 0.05, 0.7}) {
    const SE3 T_world_room(so3_exp(Vec3(0, 0, yaw)), Vec3(30, -20, 0));
    TriangleMesh mesh = room(T_world_room);
    Rng rng(5);
    for (SurfacePoint& vertex : mesh.vertices) {
      const Vec3 off = random_normals<3>(rng);
      vertex.normal_world = (vertex.normal_world + (0.05 * off).cast<float>()).normalized();
    }
    label_structure(mesh, {Vec3(0, 0, 1), 0});
    int walls = 0, named = 0, wrong = 0;
    for (const SurfacePoint& vertex : mesh.vertices) {
      const bool is_wall = std::abs(vertex.normal_world.z()) < 0.5F;
      const bool is_named = vertex.label.semantic_class == SemanticClass::kWall;
      walls += is_wall ? 1 : 0;
      named += is_wall && is_named ? 1 : 0;
      wrong += !is_wall && is_named ? 1 : 0;
    }
    EXPECT_GT(named, 0.97 * walls) << yaw;
    EXPECT_EQ(wrong, 0) << yaw;
  }
}

TEST(RoomStructure, NoisyNormalsLeaveNoHoles) {
  const SE3 T_world_room;
  TriangleMesh mesh = room(T_world_room);
  const std::vector<SurfacePoint> exact = mesh.vertices;
  Rng rng(5);
  int turned = 0;
  for (SurfacePoint& vertex : mesh.vertices) {
    if (rng.uniform() < 0.8) continue;  // a fifth faces elsewhere
    const Vec3 off = random_in_box<3>(rng, {-1, -1, -1}, {1, 1, 1});
    vertex.normal_world = (vertex.normal_world + off.cast<float>()).normalized();
    ++turned;
  }
  label_structure(mesh, {Vec3(0, 0, 1), 0});
  int floor = 0, holes = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const SemanticClass name = mesh.vertices[i].label.semantic_class;
    const float z_m = exact[i].p_world.z();
    if (std::abs(z_m - 0.75F) < 0.01F && exact[i].normal_world.z() > 0.9F) {
      ASSERT_EQ(name, SemanticClass::kUnknown) << "a table is none of the room's structure";
    }
    if (z_m > 0.01F || exact[i].normal_world.z() < 0.9F) continue;
    ++floor;
    holes += name == SemanticClass::kFloor ? 0 : 1;
  }
  EXPECT_GT(turned, 1000);
  EXPECT_LT(holes, 0.005 * floor);
}

TEST(RoomStructure, ThingsThatHangTogetherWithTheFloorAreNoneOfIt) {
  TriangleMesh mesh;
  room_test::add_rectangle(mesh, {}, {0, 0, 0}, {2, 0, 0}, {0, 2, 0});
  int raised = 0;
  for (SurfacePoint& vertex : mesh.vertices) {
    if ((vertex.p_world.head<2>().array() - 1).abs().maxCoeff() > 0.31F) continue;
    vertex.p_world.z() = 0.3F;
    ++raised;
  }
  label_structure(mesh, {Vec3(0, 0, 1), 0});
  const auto named =
      std::count_if(mesh.vertices.begin(), mesh.vertices.end(), [](const SurfacePoint& vertex) {
        return vertex.p_world.z() > 0.2F && vertex.label.semantic_class != SemanticClass::kUnknown;
      });
  EXPECT_EQ(raised, 13 * 13);
  EXPECT_LT(named, 20) << "corners alone";
}

TEST(RoomStructure, OfNothingIsNothing) {
  TriangleMesh nothing;
  const Gravity gravity = find_gravity(nothing, Vec3(0, -1, 0), Vec3::Zero());
  EXPECT_NEAR(gravity.up_world.y(), -1, 1e-12);
  label_structure(nothing, gravity);
}

}  // namespace
}  // namespace ygslam
