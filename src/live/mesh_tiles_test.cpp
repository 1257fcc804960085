#include "live/mesh_tiles.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "live/run_topics.hpp"
#include "scene/class_colour.hpp"

namespace ygslam {
namespace {

constexpr double kStep_m = 0.02;

/// A floor of the world (y is down) from x_m on, so many metres wide and 1 m deep.
TriangleMesh floor_of(double x_m, int width_m,
                      SemanticClass semantic_class = SemanticClass::kFloor) {
  TriangleMesh mesh;
  const int columns = static_cast<int>(std::lround(width_m / kStep_m));
  const int rows = static_cast<int>(std::lround(1 / kStep_m));
  const auto at = [rows](int i, int k) { return static_cast<std::uint32_t>(i * rows + k); };
  for (int i = 0; i < columns; ++i)
    for (int k = 0; k < rows; ++k) {
      SurfacePoint point;
      point.p_world = Vec3(x_m + kStep_m * (i + 0.5), 1.51, kStep_m * (k + 0.5)).cast<float>();
      point.normal_world = {0, -1, 0};
      point.colour = {200, 100, 50};
      point.label.semantic_class = semantic_class;
      mesh.vertices.push_back(point);
    }
  for (int i = 0; i + 1 < columns; ++i)
    for (int k = 0; k + 1 < rows; ++k) {
      mesh.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      mesh.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  return mesh;
}

ClusteredMesh coarse(const TriangleMesh& mesh) { return reduced_mesh(mesh, 0, 1'000'000); }

std::size_t triangles_of(const std::vector<MeshTile>& tiles) {
  std::size_t points = 0;
  for (const MeshTile& tile : tiles)
    for (const ros::Marker& marker : tile.markers) points += marker.points.size();
  return points / 3;
}

TEST(MeshTiles, MarkersHoldTheMeshInTheAxesOfTheMap) {
  const ClusteredMesh mesh = coarse(floor_of(0, 3));
  MeshTiles tiles(MeshTiles::Colours::kSeen);
  const auto told = tiles.changed(mesh, {7, 8});
  EXPECT_EQ(told.size(), 3U);
  EXPECT_EQ(triangles_of(told), mesh.mesh.triangles.size());
  for (const MeshTile& tile : told) {
    ASSERT_EQ(tile.markers.size(), 1U);
    const ros::Marker& marker = tile.markers[0];
    EXPECT_EQ(marker.type, ros::Marker::kTriangleList);
    EXPECT_EQ(marker.header.frame_id, "map");
    EXPECT_EQ(marker.header.stamp.sec, 7);
    EXPECT_EQ(marker.id, static_cast<std::int32_t>(tile.number));
    EXPECT_EQ(marker.points.size() % 3, 0U);
    ASSERT_EQ(marker.colours.size(), marker.points.size());
    EXPECT_NEAR(marker.colours[0].r, 200 / 255.0, 1e-6);
    for (const ros::Vector3& p : marker.points) EXPECT_NEAR(p.z, -1.51, 1e-6) << "z is up";
  }
}

TEST(MeshTiles, OnlyWhatLooksDifferentIsToldAgain) {
  MeshTiles tiles(MeshTiles::Colours::kSeen);
  EXPECT_EQ(tiles.changed(coarse(floor_of(0, 3)), {}).size(), 3U);
  TriangleMesh mesh = floor_of(0, 3);
  for (SurfacePoint& point : mesh.vertices) point.p_world.y() += 0.002F;
  EXPECT_TRUE(tiles.changed(coarse(mesh), {}).empty()) << "noise";
  for (SurfacePoint& point : mesh.vertices)
    if (point.p_world.x() > 2.2F) point.p_world.y() += 0.02F;
  const auto moved = tiles.changed(coarse(mesh), {});
  ASSERT_EQ(moved.size(), 1U);
  EXPECT_NEAR(moved[0].markers[0].points[0].y, -2.5, 0.6);
  for (SurfacePoint& point : mesh.vertices)
    if (point.p_world.x() < 0.8F && point.p_world.x() > 0.2F) point.colour.b = 200;
  EXPECT_EQ(tiles.changed(coarse(mesh), {}).size(), 1U);
}

TEST(MeshTiles, WhatWentIsDeletedAndWhatComesAgainHasItsNumber) {
  MeshTiles tiles(MeshTiles::Colours::kSeen);
  const auto before = tiles.changed(coarse(floor_of(0, 3)), {});
  const auto gone = tiles.changed(coarse({}), {});
  ASSERT_EQ(gone.size(), before.size());
  for (std::size_t i = 0; i < gone.size(); ++i) {
    ASSERT_EQ(gone[i].markers.size(), 1U);
    EXPECT_EQ(gone[i].markers[0].action, ros::Marker::kDelete);
    EXPECT_EQ(gone[i].number, before[i].number);
    EXPECT_TRUE(gone[i].markers[0].points.empty());
  }
  EXPECT_TRUE(tiles.changed(coarse({}), {}).empty());
  EXPECT_EQ(tiles.changed(coarse(floor_of(0, 3)), {})[0].number, before[0].number);
}

TEST(MeshTiles, ClassesAreNamespacesAndLateListenersSeeNoneThatWent) {
  MeshTiles tiles(MeshTiles::Colours::kClasses);
  TriangleMesh mesh = floor_of(0, 1);
  for (SurfacePoint& point : mesh.vertices)
    if (point.p_world.x() > 0.5F) point.label.semantic_class = coco_class(56);
  auto told = tiles.changed(coarse(mesh), {});
  std::map<std::string, ros::Colour> colours;
  for (const MeshTile& tile : told)
    for (const ros::Marker& marker : tile.markers) {
      colours[marker.ns] = marker.colour;
      EXPECT_TRUE(marker.colours.empty()) << "one for all";
    }
  ASSERT_EQ(colours.size(), 2U);
  EXPECT_NEAR(colours.at("chair").r, class_colour(coco_class(56)).r / 255.0, 1e-6);
  EXPECT_NEAR(colours.at("floor").g, class_colour(SemanticClass::kFloor).g / 255.0, 1e-6);

  const auto count = [&](const char* ns, std::int32_t action) {
    int markers = 0;
    for (const MeshTile& tile : told)
      for (const ros::Marker& marker : tile.markers)
        markers += marker.ns == ns && marker.action == action ? 1 : 0;
    return markers;
  };
  told = tiles.changed(coarse(floor_of(0, 1)), {});
  EXPECT_GE(count("chair", ros::Marker::kDelete), 1);
  EXPECT_EQ(count("chair", ros::Marker::kAdd), 0);
  told = tiles.changed(coarse(floor_of(0, 1, SemanticClass::kWall)), {});
  EXPECT_GE(count("chair", ros::Marker::kDelete), 1) << "who missed the last message needs it";
  EXPECT_GE(count("wall", ros::Marker::kAdd), 1);
}

TEST(MeshTiles, ALargeWorldIsToldMoreCoarsely) {
  const TriangleMesh mesh = floor_of(0, 10);
  const ClusteredMesh fine = reduced_mesh(mesh, 0, 100'000);
  EXPECT_DOUBLE_EQ(fine.cell_m, 0.025);
  const ClusteredMesh coarser = reduced_mesh(mesh, 0, 3000);
  EXPECT_LE(coarser.mesh.triangles.size(), 3000U);
  EXPECT_GT(coarser.mesh.triangles.size(), 500U);
  EXPECT_DOUBLE_EQ(reduced_mesh(mesh, coarser.cell_m, 100'000).cell_m, coarser.cell_m);
  EXPECT_LE(reduced_mesh(mesh, 0, 0).cell_m, kTile_m) << "as coarse as it goes";
}

struct Listener final : MessageSink {
  struct Message {
    std::string topic;
    std::uint32_t part;
    ros::MarkerArray markers;
  };
  std::set<std::string, std::less<>> topics;
  std::vector<Message> heard;
  [[nodiscard]] bool wants(std::string_view topic) const override { return topics.contains(topic); }
  void put(std::string_view topic, const char* type, Timestamp /*stamp*/, Bytes cdr,
           std::uint32_t part) override {
    EXPECT_STREQ(type, ros::MarkerArray::kType);
    Message& message = heard.emplace_back(std::string(topic), part);
    EXPECT_TRUE(from_cdr(cdr, message.markers));
  }
};

TEST(MeshTopics, AreTilesOrAWholeAndOnlyForThoseWhoAsk) {
  const auto named = [] { return NamedMesh{floor_of(0, 3), Vec3(0, -1, 0), Vec3(0, 0, 0)}; };
  MeshTopics topics;
  Listener listener;
  EXPECT_FALSE(MeshTopics::wanted(listener));
  using Extent = MeshTopics::Extent;
  topics.publish(named(), {}, Extent::kTiles, listener);
  EXPECT_TRUE(listener.heard.empty());

  listener.topics = {"/mesh"};
  topics.publish(named(), {}, Extent::kTiles, listener);
  ASSERT_EQ(listener.heard.size(), 3U);
  std::set<std::uint32_t> parts;
  for (const auto& message : listener.heard) {
    EXPECT_EQ(message.topic, "/mesh");
    EXPECT_EQ(message.markers.markers.size(), 1U);
    parts.insert(message.part);
  }
  EXPECT_EQ(parts.size(), 3U);
  EXPECT_FALSE(parts.contains(0));

  listener = {};
  listener.topics = {"/mesh/classes"};
  topics.publish(named(), {}, Extent::kChanged, listener);
  ASSERT_EQ(listener.heard.size(), 1U);
  EXPECT_EQ(listener.heard[0].markers.markers.size(), 3U);
  EXPECT_EQ(listener.heard[0].markers.markers[0].ns, "floor");
  topics.publish(named(), {}, Extent::kChanged, listener);
  EXPECT_EQ(listener.heard.size(), 1U) << "nothing changed";
  topics.publish(named(), {}, Extent::kWhole, listener);
  ASSERT_EQ(listener.heard.size(), 2U);
  EXPECT_EQ(listener.heard[1].markers.markers[0].action, ros::Marker::kDeleteAll);
  EXPECT_EQ(listener.heard[1].markers.markers.size(), 4U);
}

}  // namespace
}  // namespace ygslam
