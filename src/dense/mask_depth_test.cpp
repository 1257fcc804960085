#include "dense/mask_depth.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

constexpr std::uint8_t kIt = 1, kOther = 2;

/// Everything at one distance.
DepthView wall_at(double distance_m) {
  DepthView view;
  view.camera = {100, 100, 31.5, 23.5, 64, 48};
  view.depth = Image<std::uint16_t>(64, 48);
  view.colour = ColourImage(64, 48);
  view.object = Image<std::uint8_t>(64, 48);
  view.objects = {SceneObjectId{1}, SceneObjectId{2}};
  for (auto& depth : view.depth)
    depth = static_cast<std::uint16_t>(distance_m / DepthView::kUnit_m);
  return view;
}

void fill(Image<std::uint16_t>& image, int left, int top, int right, int bottom, double depth_m) {
  for (int v = top; v < bottom; ++v)
    for (int u = left; u < right; ++u)
      image.at(u, v) = static_cast<std::uint16_t>(depth_m / DepthView::kUnit_m);
}
void mark(DepthView& view, int left, int top, int right, int bottom, std::uint8_t object) {
  for (int v = top; v < bottom; ++v)
    for (int u = left; u < right; ++u) view.object.at(u, v) = object;
}
auto count(const DepthView& view, std::uint8_t object) {
  return std::count(view.object.begin(), view.object.end(), object);
}

TEST(MaskDepth, TheWallAroundABottleIsNoneOfIt) {
  DepthView view = wall_at(2.0);
  fill(view.depth, 20, 10, 30, 40, 1.5);
  mark(view, 19, 9, 31, 41, kIt);
  drop_what_lies_elsewhere(view, {});
  for (int v = 0; v < 48; ++v)
    for (int u = 0; u < 64; ++u)
      ASSERT_EQ(view.object.at(u, v) == kIt, u >= 20 && u < 30 && v >= 10 && v < 40)
          << u << ' ' << v;
  EXPECT_EQ(count(view, DepthView::kUnsure), 12 * 32 - 10 * 30) << "the mask or the depth is wrong";
}

TEST(MaskDepth, APartWithinItsDepthsBelongsToIt) {
  DepthView view = wall_at(3.0);
  for (int v = 5; v < 25; ++v) fill(view.depth, 10, v, 50, v + 1, 1.5 + 0.01 * v);  // a seat
  fill(view.depth, 12, 30, 15, 40, 1.6);                                            // a leg
  mark(view, 10, 5, 50, 25, kIt);
  mark(view, 12, 30, 15, 40, kIt);
  const auto before = count(view, kIt);
  drop_what_lies_elsewhere(view, {});
  EXPECT_EQ(count(view, kIt), before);
}

TEST(MaskDepth, BothHalvesBehindAPoleAreIts) {
  DepthView view = wall_at(2.0);
  fill(view.depth, 30, 0, 34, 48, 1.0);
  for (int v = 0; v < 48; ++v) fill(view.depth, 34, v, 60, v + 1, 2.6);
  mark(view, 5, 5, 60, 40, kIt);
  mark(view, 30, 0, 34, 48, kOther);
  drop_what_lies_elsewhere(view, {});
  EXPECT_EQ(view.object.at(10, 20), kIt);
  EXPECT_EQ(view.object.at(50, 20), kIt);
  EXPECT_EQ(count(view, kOther), 4 * 48);
}

}  // namespace
}  // namespace ygslam
