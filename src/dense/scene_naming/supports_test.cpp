#include "dense/scene_naming/supports.hpp"

#include <gtest/gtest.h>

#include "dense/scene_naming/room_test_mesh.hpp"

namespace ygslam {
namespace {

using room_test::add_rectangle;

class SupportRoom : public ::testing::Test {
 protected:
  /// @param bottom_room middle of its lower side.
  [[nodiscard]] SceneObject thing(const Vec3& bottom_room, const Vec3& size_m) const {
    SceneObject object;
    const SE3 T_room_box(so3_exp(Vec3(0, 0, 0.4)), bottom_room + Vec3(0, 0, 0.5 * size_m.z()));
    object.box = {T_world_room_ * T_room_box, size_m};
    return object;
  }
  /// Of its box, where it stands by now, above the room's floor.
  [[nodiscard]] double bottom_m(const OrientedBox& box) const {
    return (T_world_room_.inverse() * box.T_world_box.t()).z() - 0.5 * box.size_m.z();
  }
  [[nodiscard]] double top_m(const OrientedBox& box) const {
    return bottom_m(box) + box.size_m.z();
  }
  void stand(SceneObject& object) const { stand_on_supports(mesh_, gravity_, {&object, 1}); }

  SE3 T_world_room_{so3_exp(Vec3(-1.4, 0.5, 0.1)), Vec3(0.4, 1.2, -0.7)};
  TriangleMesh mesh_ = room_test::room(T_world_room_);
  Gravity gravity_{T_world_room_.R().col(2), T_world_room_.t().dot(T_world_room_.R().col(2))};
};

TEST_F(SupportRoom, AScreenStandsOnItsTableAndAChairOnTheFloor) {
  SceneObject screen = thing({1.7, 1.5, 0.9}, {0.5, 0.06, 0.28});
  SceneObject chair = thing({3.2, 1.5, 0.4}, {0.5, 0.5, 0.57});
  for (SceneObject* object : {&screen, &chair}) {
    const OrientedBox before = object->box;
    stand(*object);
    EXPECT_NEAR(top_m(object->box), top_m(before), 1e-6);
    EXPECT_EQ(object->box.size_m.head<2>(), before.size_m.head<2>());
  }
  EXPECT_NEAR(bottom_m(screen.box), 0.75, 1e-5);
  EXPECT_NEAR(bottom_m(chair.box), 0, 1e-5);
}

TEST_F(SupportRoom, PlacesThatItLeftCountToo) {
  SceneObject chair = thing({3.2, 1.5, 0.4}, {0.5, 0.5, 0.57});
  chair.earlier.push_back({thing({3.2, 0.6, 0.3}, {0.5, 0.5, 0.57}).box, {}, {}, {}});
  stand(chair);
  EXPECT_NEAR(bottom_m(chair.earlier[0].box), 0, 1e-5);
}

TEST_F(SupportRoom, WhatHangsHighOrStandsAlreadyStaysAsItIs) {
  SceneObject picture = thing({1.7, 1.5, 1.2}, {0.5, 0.03, 0.4});
  SceneObject cup = thing({1.7, 1.5, 0.75}, {0.1, 0.1, 0.1});
  for (SceneObject* object : {&picture, &cup}) {
    const OrientedBox before = object->box;
    stand(*object);
    EXPECT_NEAR(object->box.size_m.z(), before.size_m.z(), 1e-6);
  }
}

TEST_F(SupportRoom, TheFirstSurfaceBelowCarriesIt) {
  add_rectangle(mesh_, T_world_room_, {3.0, 1.2, 0.4}, {0.5, 0, 0}, {0, 0.5, 0});  // a stool
  SceneObject plant = thing({3.25, 1.45, 0.5}, {0.4, 0.4, 0.9});
  stand(plant);
  EXPECT_NEAR(bottom_m(plant.box), 0.4, 1e-5);
}

TEST_F(SupportRoom, AnEdgeOfSomethingBelowIsNoSupport) {
  add_rectangle(mesh_, T_world_room_, {3.0, 1.2, 1.0}, {0.15, 0, 0}, {0, 0.5, 0});
  SceneObject plant = thing({3.3, 1.5, 1.2}, {0.4, 0.4, 0.5});  // on what nobody saw
  stand(plant);
  EXPECT_NEAR(bottom_m(plant.box), 1.2, 1e-6);
}

}  // namespace
}  // namespace ygslam
