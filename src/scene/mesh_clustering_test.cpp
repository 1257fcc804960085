#include "scene/mesh_clustering.hpp"

#include <gtest/gtest.h>

#include <map>

namespace ygslam {
namespace {

constexpr double kCell_m = 0.1;

/// A square of 1 m in the plane z = 0.05, facing up, of so many vertices along each side.
TriangleMesh square(int side) {
  TriangleMesh mesh;
  const auto at = [side](int x, int y) { return static_cast<std::uint32_t>(y * side + x); };
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      SurfacePoint point;
      const float step_m = 1.0F / static_cast<float>(side - 1);
      point.p_world = {step_m * static_cast<float>(x), step_m * static_cast<float>(y), 0.05F};
      point.normal_world = {0, 0, 1};
      point.colour = {static_cast<std::uint8_t>(x < side / 2 ? 200 : 40), 100, 50};
      point.label.semantic_class = x < side / 2 ? SemanticClass::kFloor : SemanticClass::kWall;
      mesh.vertices.push_back(point);
    }
  for (int y = 0; y + 1 < side; ++y)
    for (int x = 0; x + 1 < side; ++x) {
      mesh.triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      mesh.triangles.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  return mesh;
}

double area_m2(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3f& p = mesh.vertices[a].p_world;
    const Eigen::Vector3f up =
        (mesh.vertices[b].p_world - p).cross(mesh.vertices[c].p_world - p) / 2;
    EXPECT_GT(up.z(), 0) << "none turns over";
    sum += static_cast<double>(up.z());
  }
  return sum;
}

TEST(MeshClustering, SmallPiecesAloneAreSpecks) {
  ClusteredMesh clustered{kCell_m, square(5), {}};  // 1 m2
  const auto add_triangle = [&](float side_m, float height_m) {
    const auto first = static_cast<std::uint32_t>(clustered.mesh.vertices.size());
    for (const Eigen::Vector3f& p :
         {Eigen::Vector3f(0, 0, height_m), {side_m, 0, height_m}, {0, side_m, height_m}}) {
      clustered.mesh.vertices.emplace_back().p_world = p;
    }
    clustered.mesh.triangles.push_back({first, first + 1, first + 2});
  };
  add_triangle(0.2F, 1);  // 0.02 m2
  add_triangle(0.3F, 2);  // 0.045 m2
  const std::size_t vertices = clustered.mesh.vertices.size();
  const ClusteredMesh clean = without_specks(clustered, 0.03);
  EXPECT_NEAR(area_m2(clean.mesh), 1.045, 1e-6) << "whose triangles are each smaller than that";
  EXPECT_EQ(clean.mesh.vertices.size(), vertices);
  EXPECT_NEAR(area_m2(without_specks(clustered, 0).mesh), 1.065, 1e-6);
}

TEST(MeshClustering, AFlatSurfaceStaysItselfWithFarFewerTriangles) {
  const TriangleMesh fine = square(101);
  const ClusteredMesh coarse = clustered_mesh(fine, kCell_m);
  EXPECT_LT(coarse.mesh.triangles.size() * 50, fine.triangles.size());
  EXPECT_NEAR(area_m2(coarse.mesh), 1, 0.2) << "its border is half a cell in at most";
  ASSERT_EQ(coarse.cells.size(), coarse.mesh.vertices.size());
  for (std::size_t i = 0; i < coarse.cells.size(); ++i) {
    const SurfacePoint& point = coarse.mesh.vertices[i];
    EXPECT_FLOAT_EQ(point.p_world.z(), 0.05F);
    EXPECT_FLOAT_EQ(point.normal_world.z(), 1);
    const Eigen::Vector3d corner_m = coarse.cells[i].cast<double>() * kCell_m;
    for (int axis = 0; axis < 2; ++axis) {
      EXPECT_GE(point.p_world[axis], corner_m[axis] - 1e-6);
      EXPECT_LE(point.p_world[axis], corner_m[axis] + kCell_m + 1e-6);
    }
  }
}

TEST(MeshClustering, ClassesAndColoursAreThoseOfMost) {
  const ClusteredMesh coarse = clustered_mesh(square(101), kCell_m);
  for (const SurfacePoint& point : coarse.mesh.vertices) {
    if (point.p_world.x() < 0.45F) {
      EXPECT_EQ(point.label.semantic_class, SemanticClass::kFloor);
      EXPECT_EQ(point.colour.r, 200);
    } else if (point.p_world.x() > 0.55F) {
      EXPECT_EQ(point.label.semantic_class, SemanticClass::kWall);
      EXPECT_EQ(point.colour.r, 40);
    }
  }
}

TEST(MeshClustering, WhatFitsIntoOneCellVanishes) {
  TriangleMesh mesh = square(3);
  for (SurfacePoint& point : mesh.vertices) point.p_world *= 0.05F;
  EXPECT_TRUE(clustered_mesh(mesh, kCell_m).mesh.triangles.empty());
  EXPECT_TRUE(clustered_mesh({}, kCell_m).mesh.vertices.empty());
}

TEST(MeshClustering, TheSameCellsWhateverElseIsThere) {
  TriangleMesh more = square(101);
  std::vector<SurfacePoint> others = more.vertices;
  for (SurfacePoint& point : others) point.p_world.x() += 2;
  const auto shift = static_cast<std::uint32_t>(others.size());
  more.vertices.insert(more.vertices.begin(), others.begin(), others.end());
  for (auto& triangle : more.triangles)
    for (std::uint32_t& corner : triangle) corner += shift;
  const ClusteredMesh alone = clustered_mesh(square(101), kCell_m),
                      beside = clustered_mesh(more, kCell_m);
  std::map<std::array<int, 3>, Eigen::Vector3f> there;
  const auto key = [](const Eigen::Vector3i& c) { return std::array{c.x(), c.y(), c.z()}; };
  for (std::size_t i = 0; i < beside.cells.size(); ++i)
    there[key(beside.cells[i])] = beside.mesh.vertices[i].p_world;
  std::size_t found = 0;
  for (std::size_t i = 0; i < alone.cells.size(); ++i)
    found += there.at(key(alone.cells[i])) == alone.mesh.vertices[i].p_world ? 1 : 0;
  EXPECT_EQ(found, alone.cells.size());
  EXPECT_EQ(alone.mesh.triangles.size(), beside.mesh.triangles.size());
}

}  // namespace
}  // namespace ygslam
