#include "dense/scene_naming/edge_labels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dense/scene_naming/room_test_mesh.hpp"
#include "volume/depth_view.hpp"

namespace ygslam {
namespace {

constexpr SceneObjectId kLeft{3}, kRight{5};
constexpr double kDistance_m = 2;

/// A wall of vertices every 5 cm, which calls those left of an edge the one, those right the other.
TriangleMesh wall(double edge_m) {
  TriangleMesh mesh;
  room_test::add_rectangle(mesh, {}, Vec3(-0.5, -0.5, kDistance_m), {0, 1, 0}, {1, 0, 0});
  for (SurfacePoint& vertex : mesh.vertices)
    vertex.label = {SemanticClass::kUnknown, vertex.p_world.x() < edge_m ? kLeft : kRight, 0.6F};
  return mesh;
}

/// What a camera at x sees of the wall whose edge is at 0.
DepthView view_of_wall(double x_m, double distance_m = kDistance_m) {
  DepthView view;
  view.camera = {160, 160, 79.5, 59.5, 160, 120};
  view.depth = Image<std::uint16_t>(160, 120);
  view.colour = ColourImage(160, 120);
  view.object = Image<std::uint8_t>(160, 120);
  view.objects = {kRight, kLeft};
  for (int v = 0; v < 120; ++v) {
    for (int u = 0; u < 160; ++u) {
      view.depth.at(u, v) = static_cast<std::uint16_t>(distance_m / DepthView::kUnit_m);
      view.object.at(u, v) = x_m + (u - 79.5) / 160 * kDistance_m < 0 ? 2 : 1;
    }
  }
  return view;
}
SE3 camera_at(double x_m) { return SE3(Mat3::Identity(), Vec3(x_m, 0, 0)); }

/// Vertices on the wrong side, but for those that a pixel's width parts from the edge.
int count_wrong(const TriangleMesh& mesh) {
  int wrong = 0;
  for (const SurfacePoint& vertex : mesh.vertices) {
    if (std::abs(vertex.p_world.x()) < 0.0125F) continue;
    wrong += (vertex.label.object == kLeft) != (vertex.p_world.x() < 0) ? 1 : 0;
  }
  return wrong;
}

class EdgeOfAWall : public ::testing::Test {
 protected:
  void name(const std::vector<DepthView>& views) {
    EdgeLabels edges(mesh_, {});
    ASSERT_FALSE(edges.empty());
    for (const DepthView& view : views) edges.add_votes(view, camera_at(0));
    edges.write_labels(mesh_);
  }
  TriangleMesh mesh_ = wall(0.06);
  int before_ = count_wrong(mesh_);
};

TEST_F(EdgeOfAWall, EachVertexBesideItIsWhatPixelsShow) {
  ASSERT_GT(before_, 0);
  EdgeLabels edges(mesh_, {});
  for (const double x_m : {-0.2, 0.0, 0.2}) edges.add_votes(view_of_wall(x_m), camera_at(x_m));
  edges.write_labels(mesh_);
  EXPECT_EQ(count_wrong(mesh_), 0);
  for (const SurfacePoint& vertex : mesh_.vertices) {
    const bool is_asked = vertex.p_world.x() > -0.02F && vertex.p_world.x() < 0.17F;
    ASSERT_EQ(vertex.label.probability, is_asked ? 1.0F : 0.6F) << "two on either side";
  }
}

TEST_F(EdgeOfAWall, WhatHidesItOrLiesBehindSaysNothing) {
  name({view_of_wall(0, kDistance_m - 0.3), view_of_wall(0, kDistance_m + 0.3)});
  EXPECT_EQ(count_wrong(mesh_), before_);
}

TEST_F(EdgeOfAWall, DepthIsItsOwnWithinNoiseAndACentimetre) {
  const double reach_m = 0.01 + 3 * static_cast<double>(NoiseModel(DepthNoise{}).sigma_m(2));
  name({view_of_wall(0, kDistance_m - reach_m - 1e-3)});
  EXPECT_EQ(count_wrong(mesh_), before_);
  name({view_of_wall(0, kDistance_m - reach_m + 1e-3)});
  EXPECT_EQ(count_wrong(mesh_), 0);
}

TEST_F(EdgeOfAWall, WithoutDepthTooFarAndElsewhereNobodySeesIt) {
  DepthView empty = view_of_wall(0);
  std::fill(empty.depth.begin(), empty.depth.end(), std::uint16_t{0});
  const SE3 turned(so3_exp(Vec3(0, 2, 0)), Vec3::Zero());
  PreparationConfig near;
  near.max_depth_m = kDistance_m - 0.1;
  EdgeLabels edges(mesh_, {}), too_far(mesh_, near);
  edges.add_votes(empty, camera_at(0));
  edges.add_votes(view_of_wall(0), turned);
  too_far.add_votes(view_of_wall(0), camera_at(0));
  edges.write_labels(mesh_);
  too_far.write_labels(mesh_);
  EXPECT_EQ(count_wrong(mesh_), before_);
}

TEST_F(EdgeOfAWall, TheCamerasPoseIsUsed) {  // the same picture of all that is turned and moved
  const SE3 T_new_old(so3_exp(Vec3(0.3, -1.1, 0.7)), Vec3(2, -1, 0.5));
  TriangleMesh moved = mesh_;
  for (SurfacePoint& vertex : moved.vertices) {
    vertex.p_world = (T_new_old * vertex.p_world.cast<double>()).cast<float>();
  }
  EdgeLabels edges(moved, {});
  edges.add_votes(view_of_wall(0.1), T_new_old * camera_at(0.1));
  edges.write_labels(moved);
  for (std::size_t i = 0; i < moved.vertices.size(); ++i)
    mesh_.vertices[i].label = moved.vertices[i].label;
  EXPECT_EQ(count_wrong(mesh_), 0);
}

TEST_F(EdgeOfAWall, PixelsThatAreNotSureOrExcludedSayNothing) {
  std::vector<DepthView> views;
  for (const std::uint8_t shown : {DepthView::kUnsure, DepthView::kExcluded})
    for (auto& object : views.emplace_back(view_of_wall(0)).object) object = shown;
  name(views);
  EXPECT_EQ(count_wrong(mesh_), before_);
  views.push_back(view_of_wall(0));
  name(views);
  EXPECT_EQ(count_wrong(mesh_), 0) << "one that knows is enough";
}

TEST_F(EdgeOfAWall, MoreViewsThatSeeNothingThereThanAThingMakeItNothing) {
  DepthView none = view_of_wall(0);
  for (auto& object : none.object) object = DepthView::kNothing;
  name({view_of_wall(0), none});
  EXPECT_EQ(count_wrong(mesh_), 0) << "as many";
  mesh_ = wall(0.06);
  name({view_of_wall(0), none, none});
  EXPECT_TRUE(std::any_of(mesh_.vertices.begin(), mesh_.vertices.end(), [](const auto& vertex) {
    return vertex.label.object == kNoSceneObject && vertex.label.probability > 0.6F;
  }));
}

TEST(EdgeLabels, WhereNothingMeetsNobodyIsAsked) {
  EXPECT_TRUE(EdgeLabels(wall(9), {}).empty());
  EXPECT_TRUE(EdgeLabels({}, {}).empty());
}

}  // namespace
}  // namespace ygslam
