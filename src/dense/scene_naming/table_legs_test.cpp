#include "dense/scene_naming/table_legs.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <tuple>

#include "dense/scene_naming/room_test_mesh.hpp"
#include "dense/scene_naming/tables.hpp"

namespace ygslam {
namespace {

using room_test::add_rectangle;
using room_test::room;

/// The top is 1 m to 2.5 m, 1 m to 2 m, 0.75 m high.
class TableLegs : public ::testing::Test {
 protected:
  /// Upright and level faces of a box that stands at corner.
  void add_box(const Vec3& corner, const Vec3& size_m) {
    const Vec3 x(size_m.x(), 0, 0), y(0, size_m.y(), 0), z(0, 0, size_m.z());
    add_rectangle(mesh_, T_world_room_, corner, x, z);
    add_rectangle(mesh_, T_world_room_, corner, z, y);
    add_rectangle(mesh_, T_world_room_, corner + x, y, z);
    add_rectangle(mesh_, T_world_room_, corner + y, z, x);
    add_rectangle(mesh_, T_world_room_, corner + z, x, y);
  }
  void see_air(const Vec3& low, const Vec3& high) {
    for (double x = low.x(); x < high.x(); x += 0.02)
      for (double y = low.y(); y < high.y(); y += 0.02)
        for (double z = low.z(); z < high.z(); z += 0.02) {
          const Vec3 p_world = T_world_room_ * Vec3(x, y, z);
          SpaceCell cell;
          cell.index = (p_world / space_.cell_m).array().floor().cast<int>();
          cell.state = SpaceState::kFree;
          space_.cells.push_back(cell);
        }
    const auto order = [](const SpaceCell& cell) {
      return std::tuple(cell.index.z(), cell.index.y(), cell.index.x());
    };
    std::ranges::sort(space_.cells, std::less<>(), order);
    const auto [from, to] = std::ranges::unique(space_.cells, std::equal_to<>(), order);
    space_.cells.erase(from, to);
  }
  /// Of all vertices lower than the plate: how many are the table's.
  [[nodiscard]] auto named_below() {
    const auto tables = find_tables(mesh_, gravity_, {}, space_);
    EXPECT_EQ(tables.size(), 1U);
    return std::ranges::count_if(mesh_.vertices, [&](const SurfacePoint& vertex) {
      return vertex.label.object == kFirstTable &&
             (T_world_room_.inverse() * vertex.p_world.cast<double>()).z() < 0.68;
    });
  }

  SE3 T_world_room_{so3_exp(Vec3(-1.4, 0.5, 0.1)), Vec3(0.4, 1.2, -0.7)};
  TriangleMesh mesh_ = room(T_world_room_);
  Gravity gravity_{T_world_room_.R().col(2), T_world_room_.t().dot(T_world_room_.R().col(2))};
  SpaceCells space_;
};

TEST_F(TableLegs, WhatIsThinAndReachesFromTheFloorToTheTopIsALeg) {
  add_box({1.05, 1.05, 0}, {0.05, 0.05, 0.65});
  // Four faces of 2 x 14 vertices, without the lowest, which is the floor's.
  EXPECT_EQ(named_below(), 4 * 2 * 13);
}

TEST_F(TableLegs, OfATopThatMasksShowWholeTheyAreNamedToo) {
  add_box({1.05, 1.05, 0}, {0.05, 0.05, 0.65});
  SceneObject table;
  table.id = SceneObjectId{4};
  table.semantic_class = coco_class(60);
  table.state = ObjectState::kStatic;
  table.box = {SE3(T_world_room_.R(), T_world_room_ * Vec3(1.75, 1.5, 0.375)), Vec3(1.5, 1, 0.8)};
  const auto is_top = [&](const SurfacePoint& vertex) {
    const Vec3 p_room = T_world_room_.inverse() * vertex.p_world.cast<double>();
    return std::abs(p_room.z() - 0.75) < 1e-3 && p_room.y() > 0.9 && p_room.x() > 0.9;
  };
  for (SurfacePoint& vertex : mesh_.vertices)
    if (is_top(vertex)) vertex.label = {table.semantic_class, table.id, 1};
  const auto named = [&] {
    return std::ranges::count(mesh_.vertices, table.id,
                              [](const SurfacePoint& vertex) { return vertex.label.object; });
  };
  const auto before = named();
  EXPECT_TRUE(find_tables(mesh_, gravity_, {&table, 1}, space_).empty());
  EXPECT_EQ(named(), before + 4 * 2 * 13);
}

TEST_F(TableLegs, WhatStandsOnTheTopAboveALegIsNoPartOfIt) {
  add_box({1.05, 1.05, 0}, {0.05, 0.05, 0.65});
  add_box({1.05, 1.05, 0.8}, {0.05, 0.05, 0.1});
  EXPECT_EQ(named_below(), 4 * 2 * 13);
}

TEST_F(TableLegs, WhatEndsBelowIsNone) {
  add_box({1.05, 1.05, 0}, {0.05, 0.05, 0.45});
  EXPECT_EQ(named_below(), 0) << "a bottle on the floor";
}

TEST_F(TableLegs, WhatGoesOnAboveTheTopIsNone) {
  add_box({2.5, 1.5, 0}, {0.05, 0.05, 1.4});
  EXPECT_EQ(named_below(), 0) << "the end of a partition";
}

TEST_F(TableLegs, ACabinetUnderItIsNone) {
  add_box({1.1, 1.1, 0}, {0.4, 0.5, 0.65});
  EXPECT_EQ(named_below(), 0);
}

TEST_F(TableLegs, APanelHangsWhereAirWasSeenBelowIt) {
  add_rectangle(mesh_, T_world_room_, {1.1, 1.9, 0.35}, {1.2, 0, 0}, {0, 0, 0.25});
  EXPECT_EQ(named_below(), 0) << "what is below it is hidden: it may stand on the floor";
  see_air({1, 1.8, 0.05}, {2.5, 2, 0.33});
  EXPECT_EQ(named_below(), 25 * 6);
}

TEST_F(TableLegs, WhatHangsBesideItIsNoneWhereAirWasSeenAboveIt) {
  add_rectangle(mesh_, T_world_room_, {1.1, 2.2, 0.35}, {1.2, 0, 0}, {0, 0, 0.25});
  see_air({1, 2.1, 0.05}, {2.5, 2.3, 0.33});
  EXPECT_EQ(named_below(), 25 * 6) << "a part of the top is hidden";
  mesh_ = room(T_world_room_);
  add_rectangle(mesh_, T_world_room_, {1.1, 2.2, 0.35}, {1.2, 0, 0}, {0, 0, 0.25});
  see_air({1, 2.1, 0.62}, {2.5, 2.3, 0.8});
  EXPECT_EQ(named_below(), 0) << "a radiator behind it";
}

TEST_F(TableLegs, AChairPushedUnderItIsNone) {
  add_rectangle(mesh_, T_world_room_, {1.5, 1.2, 0.45}, {0.4, 0, 0}, {0, 0.4, 0});
  see_air({1.4, 1.1, 0.05}, {2, 1.8, 0.43});
  EXPECT_EQ(named_below(), 0);
}

TEST_F(TableLegs, AnArmrestBesideItIsNone) {
  add_rectangle(mesh_, T_world_room_, {1.5, 0.8, 0.5}, {0.5, 0, 0}, {0, 0, 0.2});
  see_air({1.4, 0.7, 0.2}, {2.1, 0.9, 0.48});
  see_air({1.4, 0.7, 0.72}, {2.1, 0.9, 1});
  EXPECT_EQ(named_below(), 0);
}

TEST_F(TableLegs, TablesSideBySideKeepTheirLegs) {
  add_rectangle(mesh_, T_world_room_, {2.56, 1, 0.75}, {1.2, 0, 0}, {0, 1, 0});
  const std::size_t first = mesh_.vertices.size();
  add_box({2.44, 1.05, 0}, {0.05, 0.05, 0.65});
  const std::size_t second = mesh_.vertices.size();
  add_box({2.57, 1.05, 0}, {0.05, 0.05, 0.65});
  ASSERT_EQ(find_tables(mesh_, gravity_, {}, space_).size(), 2U);
  const auto named = [&](std::size_t from, std::size_t to, SceneObjectId table) {
    return std::count_if(mesh_.vertices.begin() + static_cast<std::ptrdiff_t>(from),
                         mesh_.vertices.begin() + static_cast<std::ptrdiff_t>(to),
                         [&](const SurfacePoint& v) { return v.label.object == table; });
  };
  const SceneObjectId other{static_cast<std::uint16_t>(static_cast<int>(kFirstTable) - 1)};
  EXPECT_EQ(named(first, second, kFirstTable), 4 * 2 * 13);
  EXPECT_EQ(named(second, mesh_.vertices.size(), other), 4 * 2 * 13);
}

TEST_F(TableLegs, WhatIsNamedKeepsItsName) {
  const auto room_vertices = mesh_.vertices.size();
  add_box({1.05, 1.05, 0}, {0.05, 0.05, 0.65});
  for (std::size_t i = room_vertices; i < mesh_.vertices.size(); ++i)
    mesh_.vertices[i].label = {coco_class(56), SceneObjectId{3}, 0.5F};
  EXPECT_EQ(named_below(), 0);
}

}  // namespace
}  // namespace ygslam
