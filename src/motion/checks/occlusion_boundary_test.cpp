#include "motion/checks/occlusion_boundary.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace ygslam {
namespace {

// A thing 1.5 m away on the left (u < 80), a wall at 3 m behind it, no depth for u in [80, 88).
DepthImage thing_before_wall() {
  DepthImage depth(160, 120);
  for (int v = 0; v < 120; ++v)
    for (int u = 0; u < 160; ++u) depth.at(u, v) = u < 80 ? 1.5F : u < 88 ? 0.0F : 3.0F;
  return depth;
}

Feature feature_at(float u, float v, float depth_m, int octave = 0) {
  Feature feature;
  feature.uv_px = {u, v};
  feature.depth_m = depth_m;
  feature.octave = static_cast<std::uint8_t>(octave);
  return feature;
}

TEST(OcclusionBoundary, BehindTheOutlineIsOnTheRimTheThingItselfIsNot) {
  const CoarseDepth depth(thing_before_wall());
  EXPECT_TRUE(is_on_occlusion_boundary(feature_at(89, 60, 3.0F, 6), depth, {}));
  EXPECT_FALSE(is_on_occlusion_boundary(feature_at(76, 60, 1.5F, 6), depth, {}));
  EXPECT_FALSE(is_on_occlusion_boundary(feature_at(40, 60, 1.5F), depth, {}));
  EXPECT_FALSE(is_on_occlusion_boundary(feature_at(130, 60, 3.0F), depth, {}));
}

TEST(OcclusionBoundary, WithoutDepthBesideANearerSurfaceIsOnTheRim) {
  const CoarseDepth depth(thing_before_wall());
  EXPECT_TRUE(is_on_occlusion_boundary(feature_at(84, 60, 0, 3), depth, {}));
}

TEST(OcclusionBoundary, ReachGrowsWithTheLevelOnWhichTheCornerWasFound) {
  const CoarseDepth depth(thing_before_wall());
  EXPECT_FALSE(is_on_occlusion_boundary(feature_at(90, 60, 3.0F, 0), depth, {}));
  EXPECT_TRUE(is_on_occlusion_boundary(feature_at(90, 60, 3.0F, 7), depth, {}));
}

TEST(OcclusionBoundary, TakesAnyPosition) {
  const CoarseDepth depth(thing_before_wall());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(is_on_occlusion_boundary(feature_at(nan, 3, 1), depth, {}));
  EXPECT_FALSE(is_on_occlusion_boundary(feature_at(-50, 3, 1), depth, {}));
  EXPECT_TRUE(is_on_occlusion_boundary(feature_at(5000, 3, 0), depth, {}));
}

}  // namespace
}  // namespace ygslam
