#include "dense/known_object.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "geometry/properties_testing.hpp"

namespace ygslam {
namespace {

constexpr double kCell_m = 0.05;
constexpr SemanticClass kCup = coco_class(41), kBowl = coco_class(45);

/// Seen so often, a second apart.
KnownObject seen(int views) {
  KnownObject object;
  for (int i = 0; i < views; ++i) object.seen.insert(Timestamp{std::int64_t{1'000'000'000} * i});
  object.shown = object.seen;
  return object;
}

/// A point of its surface that so many views showed in a mask of it, of so many that saw it.
void add_point(KnownObject& object, const Vec3& p_world, int views, int in_sight) {
  SurfacePatch& patch = object.patches[cell_key(p_world, 0.025)];
  patch.sum_world += p_world;
  ++patch.points;
  patch.views = views;
  patch.in_sight = in_sight;
  object.cells[cell_key(p_world, kCell_m)] = views;
  object.extent_world.extend(p_world);
}

RC_GTEST_PROP(CellKeyProperty, ACellHoldsThePointsThatHaveItsKey, ()) {
  const Vec3 p_world = properties::vector(100);
  const CellKey key = cell_key(p_world, kCell_m);
  const Vec3 low = low_corner(key, kCell_m);
  RC_ASSERT(((p_world - low).array() > -1e-9).all());
  RC_ASSERT(((p_world - low).array() < kCell_m + 1e-9).all());
  RC_ASSERT(cell_key(low + Vec3::Constant(0.5 * kCell_m), kCell_m) == key);
}

RC_GTEST_PROP(CellKeyProperty, StepsLeadToTheCellsAround, ()) {
  const Vec3 p_world = properties::vector(100);
  const CellKey key = cell_key(p_world, kCell_m);
  std::set<CellKey> around, stepped;
  for (int n = 0; n < 27; ++n) {
    const int x = n % 3, y = n / 3 % 3, z = n / 9;
    around.insert(
        cell_key(low_corner(key, kCell_m) + kCell_m * Vec3(x - 0.5, y - 0.5, z - 0.5), kCell_m));
  }
  for (const CellKey step : neighbour_steps()) stepped.insert(key + step);
  RC_ASSERT(around == stepped);
}

TEST(KnownObject, TheClassWithTheGreatestSumOfScoresIsItsOwn) {
  KnownObject object = seen(4);
  EXPECT_EQ(object.best_class(), SemanticClass::kUnknown);
  EXPECT_EQ(object.probability(), 0);
  object.class_scores = {{kCup, 1.2}, {kBowl, 0.9}};
  EXPECT_EQ(object.best_class(), kCup);
  EXPECT_NEAR(object.probability(), 0.3, 1e-6);
  object.shown.insert(Timestamp{99});
  object.shown.insert(Timestamp{98});
  EXPECT_NEAR(object.probability(), 0.2, 1e-6) << "two views saw its surface without a mask of it";
  object.class_scores[kCup] = 100;
  EXPECT_EQ(object.probability(), 1);
}

TEST(KnownObject, OfManyViewsASingleOneIsNotBelieved) {
  EXPECT_TRUE(seen(3).believes(1));
  EXPECT_FALSE(seen(4).believes(1));
  EXPECT_TRUE(seen(4).believes(2));
  EXPECT_FALSE(seen(25).believes(2)) << "a tenth of its views";
  EXPECT_TRUE(seen(25).believes(3));
  EXPECT_TRUE(seen(400).believes(3)) << "or three: most may show it half hidden";
  KnownObject object = seen(10);
  SurfacePatch patch;
  patch.views = 4;
  patch.in_sight = 8;
  EXPECT_TRUE(object.believes(patch));
  patch.in_sight = 9;
  EXPECT_FALSE(object.believes(patch)) << "most that saw it took it for something else";
}

TEST(KnownObject, ItsSurfaceAndPlaceAreWhatIsBelieved) {
  KnownObject object = seen(10);
  add_point(object, Vec3(0.01, 0, 0), 5, 5);
  add_point(object, Vec3(0.61, 0, 0), 1, 1);
  ASSERT_EQ(object.surface_world().size(), 1U);
  EXPECT_NEAR(object.surface_world()[0].x(), 0.01, 1e-12);
  EXPECT_EQ(object.place(), (std::vector{cell_key(Vec3(0.01, 0, 0), kCell_m)}));
}

TEST(KnownObject, MergedItKnowsWhatBothKnew) {
  KnownObject a = seen(3), b;
  b.seen = b.shown = {Timestamp{7}, Timestamp{0}};
  a.class_scores = {{kCup, 1}};
  b.class_scores = {{kCup, 0.5}, {kBowl, 2}};
  add_point(a, Vec3(0, 0, 0), 2, 3);
  add_point(b, Vec3(0, 0, 0), 1, 1);
  add_point(b, Vec3(1, 0, 0), 1, 2);
  const CellKey shared = cell_key(Vec3(0, 0, 0), 0.025);
  a.patches.at(shared).observed_at = Timestamp{5};
  b.patches.at(shared).observed_at = Timestamp{7};
  b.patches.at(shared).seen_through = true;
  a.colours[3] = 4;
  b.colours[3] = 6;
  a.empty_observations = 3;
  a.is_leaving = true;
  b.moving = Timestamp{9};
  b.moving_world = Vec3(1, 2, 3);
  a.merge(b);
  EXPECT_EQ(a.views(), 4) << "one view showed both";
  EXPECT_EQ(a.best_class(), kBowl);
  EXPECT_NEAR(a.class_scores.at(kCup), 1.5, 1e-12);
  EXPECT_EQ(a.patches.size(), 2U);
  EXPECT_EQ(a.patches.at(shared).views, 3);
  EXPECT_EQ(a.patches.at(shared).in_sight, 4);
  EXPECT_TRUE(a.patches.at(shared).seen_through) << "the later look counts";
  EXPECT_EQ(a.colours[3], 10U);
  EXPECT_EQ(a.empty_observations, 0) << "it is only as empty as the part that was seen last";
  EXPECT_FALSE(a.is_leaving);
  EXPECT_EQ(a.moving, Timestamp{9});
  EXPECT_NEAR(a.extent_world.max().x(), 1, 1e-12);
}

TEST(KnownObject, LikenessIsOfSizeAndColours) {
  KnownObject a = seen(1), b = seen(1);
  EXPECT_EQ(likeness(a, b).size, 0) << "of nothing nothing is known";
  for (const double side : {-1.0, 1.0}) {
    add_point(a, Vec3(0.1 * side, 0, 0), 1, 1);
    add_point(b, Vec3(3 + 0.2 * side, 1, 0), 1, 1);
  }
  a.colours[0] = 10;
  b.colours[0] = 3;
  b.colours[1] = 1;
  const Likeness like = likeness(a, b);
  EXPECT_NEAR(like.size, 0.5, 1e-9);
  EXPECT_NEAR(like.colour, 0.75, 1e-9);
  EXPECT_EQ(likeness(b, a).size, like.size);
  EXPECT_NEAR(likeness(a, a).colour, 1, 1e-12);
}

}  // namespace
}  // namespace ygslam
