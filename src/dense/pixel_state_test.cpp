#include "dense/pixel_state.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "geometry/properties_testing.hpp"
#include "volume/volume_test_world.hpp"

namespace ygslam {
namespace {

constexpr double kStateCell_m = 0.05;
constexpr int kMargin_px = 2;

/// A box in the middle of a room, and a post that hides a part of it.
DepthView some_view() {
  volume_test::World world;
  world.cuboids = {{Vec3(-0.3, -0.3, 0.2), Vec3(0.3, 0.3, 0.6), SceneObjectId{1}},
                   {Vec3(-0.1, -1.2, -0.4), Vec3(0.1, 1.2, -0.2), SceneObjectId{2}}};
  return volume_test::render(world, SE3(Mat3::Identity(), Vec3(0, 0, -1.2)));
}
SE3 its_pose() { return SE3(Mat3::Identity(), Vec3(0, 0, -1.2)); }

RemovedCells cells_of(const Vec3& low, const Vec3& high) {
  std::vector<CellKey> keys;
  for (double x = low.x(); x < high.x(); x += kStateCell_m)
    for (double y = low.y(); y < high.y(); y += kStateCell_m)
      for (double z = low.z(); z < high.z(); z += kStateCell_m)
        keys.push_back(cell_key(Vec3(x, y, z) + Vec3::Constant(0.5 * kStateCell_m), kStateCell_m));
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return std::make_shared<const std::vector<CellKey>>(keys);
}

PixelState plain() {
  PixelState state;
  state.ids = {SceneObjectId{7}, SceneObjectId{300}};
  return state;
}

DepthView with(const PixelState& state) {
  DepthView view = some_view();
  apply_state(state, its_pose(), kMargin_px, kStateCell_m, view);
  return view;
}

std::ptrdiff_t pixels_of(const DepthView& view, std::uint8_t object) {
  return std::count(view.object.begin(), view.object.end(), object);
}

TEST(PixelState, GivesObservationsTheNumbersOfObjects) {
  const DepthView before = some_view(), view = with(plain());
  ASSERT_EQ(before.objects.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_EQ(view.objects[i], plain().ids[static_cast<std::size_t>(before.objects[i]) - 1]);
  EXPECT_TRUE(std::equal(view.object.begin(), view.object.end(), before.object.begin()));
}

TEST(PixelState, ARemovedObjectIsExcludedWithAMarginButForOtherObjects) {
  PixelState state = plain();
  state.ids[0] = kRemovedObject;
  const DepthView before = some_view(), view = with(state);
  const auto number = [&](std::uint8_t object) {
    return DepthView::is_object(object) ? static_cast<int>(before.objects[object - 1U]) : 0;
  };
  GreyImage mask(before.object.width(), before.object.height());
  for (std::size_t i = 0; i < mask.size(); ++i)
    mask.begin()[i] = number(before.object.begin()[i]) == 1 ? 255 : 0;
  const GreyImage grown = dilated(mask, kMargin_px);
  for (std::size_t i = 0; i < mask.size(); ++i) {
    const bool is_other = number(before.object.begin()[i]) == 2;
    ASSERT_EQ(view.object.begin()[i] == DepthView::kExcluded, grown.begin()[i] != 0 && !is_other);
  }
}

TEST(PixelState, WhereAnObjectStoodNoRoomIsLeftButOtherObjectsAre) {
  PixelState state = plain();
  state.removed_objects = {cells_of(Vec3(-1.6, -1.3, -1.6), Vec3(1.6, 1.3, 1.6))};
  const DepthView before = some_view(), view = with(state);
  EXPECT_EQ(pixels_of(view, 1), pixels_of(before, 1));
  EXPECT_EQ(pixels_of(view, 2), pixels_of(before, 2));
  EXPECT_EQ(pixels_of(view, DepthView::kNothing), 0) << "what its mask left out was its own";
}

TEST(PixelState, RemovedSurfacesAreExcludedWhateverTheyWereTakenFor) {
  PixelState state = plain();
  state.removed = cells_of(Vec3(-0.35, -0.35, 0.1), Vec3(0.35, 0.35, 0.3));
  const DepthView before = some_view(), view = with(state);
  ASSERT_EQ(before.objects[0], SceneObjectId{2}) << "the post is seen first";
  EXPECT_EQ(pixels_of(view, 1), pixels_of(before, 1));
  EXPECT_EQ(pixels_of(view, 2), 0) << "the box's front is all that is seen of it";
}

TEST(PixelState, AppearedCellsAreSpared) {
  PixelState state = plain();
  state.appeared = std::make_shared<const std::vector<Eigen::Vector3i>>(
      std::vector<Eigen::Vector3i>{{1, 2, 3}, {4, 5, 6}});
  EXPECT_EQ(with(state).spared, *state.appeared);
  EXPECT_TRUE(with(without_changes(state)).spared.empty());
}

TEST(PixelState, IsComparedByContent) {
  PixelState a = plain(), b = plain();
  EXPECT_EQ(a, b);
  a.removed = cells_of(Vec3(0, 0, 0), Vec3(0.2, 0.1, 0.1));
  EXPECT_NE(a, b);
  b.removed = cells_of(Vec3(0, 0, 0), Vec3(0.2, 0.1, 0.1));
  EXPECT_NE(a.removed, b.removed) << "two copies";
  EXPECT_EQ(a, b);
  a.removed_objects = {a.removed};
  EXPECT_NE(a, b);
  b.removed_objects = {b.removed};
  EXPECT_EQ(a, b);
  EXPECT_EQ(without_changes(a).removed, nullptr);
  EXPECT_EQ(without_changes(a).removed_objects.size(), 1U);
  b.ids[0] = SceneObjectId{8};
  EXPECT_NE(a, b);
  EXPECT_EQ(space_state(a), space_state(b)) << "numbers carve no space";
  b.ids[0] = kRemovedObject;
  EXPECT_NE(space_state(a), space_state(b));
}

/// A pixel is excluded if and only if its point lies in a cell that was removed.
RC_GTEST_PROP(PixelStateProperty, RemovedCellsExcludeThePointsInThem, ()) {
  const Vec3 low = properties::vector(1.2);
  const Vec3 size = (properties::vector(0.6)).cwiseAbs();
  PixelState state = plain();
  state.removed = cells_of(low, low + size);
  const DepthView before = some_view(), view = with(state);
  const std::vector<CellKey>& cells = *state.removed;
  const Pinhole& camera = view.camera;
  for (int v = 0; v < view.depth.height(); ++v) {
    for (int u = 0; u < view.depth.width(); ++u) {
      const double depth_m = view.depth.at(u, v) * DepthView::kUnit_m;
      const Vec3 p_camera((u - camera.cx) / camera.fx * depth_m,
                          (v - camera.cy) / camera.fy * depth_m, depth_m);
      const CellKey key = cell_key(its_pose() * p_camera, kStateCell_m);
      const bool is_removed = std::binary_search(cells.begin(), cells.end(), key);
      RC_ASSERT((view.object.at(u, v) == DepthView::kExcluded) == is_removed);
      if (!is_removed) RC_ASSERT(view.object.at(u, v) == before.object.at(u, v));
    }
  }
}

}  // namespace
}  // namespace ygslam
