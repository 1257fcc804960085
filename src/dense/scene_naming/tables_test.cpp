#include "dense/scene_naming/tables.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "dense/scene_naming/named_scene.hpp"
#include "dense/scene_naming/room_test_mesh.hpp"

namespace ygslam {
namespace {

using room_test::add_rectangle;
using room_test::room;

constexpr SemanticClass kTable = coco_class(60);

class TableRoom : public ::testing::Test {
 protected:
  [[nodiscard]] auto named() const {
    return std::count_if(
        mesh_.vertices.begin(), mesh_.vertices.end(),
        [](const SurfacePoint& vertex) { return vertex.label.semantic_class == kTable; });
  }
  void add(const Vec3& corner, const Vec3& a, const Vec3& b) {
    add_rectangle(mesh_, T_world_room_, corner, a, b);
  }

  SE3 T_world_room_{so3_exp(Vec3(-1.4, 0.5, 0.1)), Vec3(0.4, 1.2, -0.7)};
  TriangleMesh mesh_ = room(T_world_room_);
  Gravity gravity_{T_world_room_.R().col(2), T_world_room_.t().dot(T_world_room_.R().col(2))};
};

TEST_F(TableRoom, ATopIsATableThatReachesTheFloor) {
  const auto tables = find_tables(mesh_, gravity_, {}, {});
  ASSERT_EQ(tables.size(), 1U);
  const SceneObject& table = tables.front();
  EXPECT_EQ(table.semantic_class, kTable);
  EXPECT_EQ(table.state, ObjectState::kStatic);
  const Vec3 middle_room = T_world_room_.inverse() * table.box.T_world_box.t();
  EXPECT_LT((middle_room - Vec3(1.75, 1.5, 0.375)).norm(), 0.02);
  EXPECT_NEAR(table.box.size_m.head<2>().prod(), 1.5, 0.1);
  EXPECT_NEAR(table.box.size_m.z(), 0.75, 0.01);
  EXPECT_EQ(named(), 31 * 21);
  for (const SurfacePoint& vertex : mesh_.vertices) {
    const bool is_its = vertex.label.object == table.id;
    ASSERT_EQ(is_its, vertex.label.semantic_class == kTable);
    ASSERT_EQ(is_its, std::abs((T_world_room_.inverse() * vertex.p_world.cast<double>()).z() -
                               0.75) < 1e-3 &&
                          vertex.label.semantic_class == kTable);
  }
}

TEST_F(TableRoom, WhatIsNarrowSmallHighLowOrUprightIsNone) {
  add({3, 0.2, 0.75}, {0.35, 0, 0}, {0, 2, 0});    // a sill
  add({3, 2.3, 0.75}, {0.4, 0, 0}, {0, 0.45, 0});  // a stool
  add({0.1, 0.2, 0.45}, {0.8, 0, 0}, {0, 2, 0});   // a bench
  add({0.1, 0.2, 1.1}, {0.8, 0, 0}, {0, 2, 0});    // a cupboard
  EXPECT_EQ(find_tables(mesh_, gravity_, {}, {}).size(), 1U);
  EXPECT_EQ(named(), 31 * 21);
  add({3.45, 0.8, 0.75}, {0.4, 0, 0}, {0, 0.45, 0});  // another, beside the sill
  EXPECT_EQ(find_tables(mesh_, gravity_, {}, {}).size(), 1U);
}

TEST_F(TableRoom, TwoSideBySideAreTwo) {
  add({1, 2.05, 0.75}, {1.5, 0, 0}, {0, 0.7, 0});
  const auto tables = find_tables(mesh_, gravity_, {}, {});
  ASSERT_EQ(tables.size(), 2U);
  EXPECT_NE(tables[0].id, tables[1].id);
}

TEST_F(TableRoom, WhatIsLeftOfATopBeyondWhatStandsOnItBelongsToIt) {
  add({1, 2.3, 0.75}, {0.4, 0, 0}, {0, 0.15, 0});    // beyond 0.3 m that are hidden
  add({2.2, 0.2, 0.75}, {0.4, 0, 0}, {0, 0.15, 0});  // 0.65 m away
  add({1, 0.7, 0.8}, {0.4, 0, 0}, {0, 0.15, 0});     // 5 cm higher
  const auto tables = find_tables(mesh_, gravity_, {}, {});
  ASSERT_EQ(tables.size(), 1U);
  EXPECT_NEAR(tables[0].box.size_m.head<2>().prod(), 1.5 * 1.45, 0.1);
  EXPECT_EQ(named(), 31 * 21 + 9 * 4);
}

TEST_F(TableRoom, AStripIsNotOfWhatLiesBeyondItsEndNorOfAScrapOrAWholeTableBesideIt) {
  add({2.6, 1, 0.75}, {0.25, 0, 0}, {0, 1, 0});       // a strip beside the table ...
  add({3.1, 2.05, 0.75}, {0.6, 0, 0}, {0, 0.2, 0});   // ... a piece beyond its end
  add({3.15, 1.4, 0.75}, {0.1, 0, 0}, {0, 0.25, 0});  // ... and a scrap before it
  const auto tables = find_tables(mesh_, gravity_, {}, {});
  ASSERT_EQ(tables.size(), 1U);
  EXPECT_NEAR(tables[0].box.size_m.head<2>().prod(), 1.5, 0.1);
}

TEST_F(TableRoom, OneThatANetworkNamedIsNotFoundTwiceButItsTopIsNamed) {
  SceneObject known;
  known.id = SceneObjectId{4};
  known.semantic_class = kTable;
  known.probability = 0.4F;
  known.state = ObjectState::kStatic;
  known.box = {SE3(T_world_room_.R(), T_world_room_ * Vec3(1.6, 1.5, 0.375)), Vec3(0.9, 1, 0.8)};
  EXPECT_TRUE(find_tables(mesh_, gravity_, {&known, 1}, {}).empty());
  EXPECT_EQ(named(), 31 * 21);
  for (const SurfacePoint& vertex : mesh_.vertices)
    if (vertex.label.semantic_class == kTable) {
      ASSERT_EQ(vertex.label.object, known.id);
      ASSERT_EQ(vertex.label.probability, 0.4F);
    }
  TriangleMesh again = room(T_world_room_);
  known.state = ObjectState::kCandidate;
  EXPECT_EQ(find_tables(again, gravity_, {&known, 1}, {}).size(), 1U);
}

TEST_F(TableRoom, WhereMasksShowNearlyAllOfATopTheRestIsNoneOfIt) {
  SceneObject known;
  known.id = SceneObjectId{4};
  known.semantic_class = kTable;
  known.state = ObjectState::kStatic;
  known.box = {SE3(T_world_room_.R(), T_world_room_ * Vec3(1.75, 1.5, 0.375)), Vec3(1.5, 1, 0.8)};
  const SE3 T_room_world = T_world_room_.inverse();
  for (const double sheet_m : {0.3, 0.6}) {  // a fifth of the top, two fifths
    mesh_ = room(T_world_room_);
    for (SurfacePoint& vertex : mesh_.vertices) {
      const Vec3 p_room = T_room_world * vertex.p_world.cast<double>();
      if (std::abs(p_room.z() - 0.75) < 1e-3 && p_room.y() > 0.9 && p_room.x() > 0.99 + sheet_m)
        vertex.label = {kTable, known.id, 1};
    }
    const auto before = named();
    EXPECT_TRUE(find_tables(mesh_, gravity_, {&known, 1}, {}).empty());
    EXPECT_EQ(named(), sheet_m < 0.5 ? before : 31 * 21);
  }
}

TEST_F(TableRoom, WhatIsNamedKeepsItsName) {
  for (SurfacePoint& vertex : mesh_.vertices) vertex.label = {coco_class(59), SceneObjectId{2}, 1};
  EXPECT_TRUE(find_tables(mesh_, gravity_, {}, {}).empty()) << "a bed is as high";
  EXPECT_EQ(named(), 0);
}

TEST_F(TableRoom, AMeshToLookAtNamesThemToo) {
  mesh_ = labelled_mesh({std::move(mesh_), gravity_.up_world, T_world_room_ * Vec3(2, 1, 1.5)});
  EXPECT_EQ(named(), 31 * 21);
  EXPECT_TRUE(std::ranges::any_of(mesh_.vertices, [](const SurfacePoint& vertex) {
    return vertex.label.semantic_class == SemanticClass::kFloor;
  }));
}

TEST(Tables, OfNothingThereAreNone) {
  TriangleMesh nothing;
  EXPECT_TRUE(find_tables(nothing, {}, {}, {}).empty());
}

}  // namespace
}  // namespace ygslam
