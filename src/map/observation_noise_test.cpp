#include "map/observation_noise.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

TEST(ObservationNoise, ACornerOnADepthEdgeWeighsLessAndIsOtherwiseTheSame) {
  Feature corner{};
  corner.ideal_px.setZero();
  corner.depth_m = 2.0F;
  const NoiseConfig noise;
  const Observation inside = observation_of(corner, 1.2, noise, 0.5);
  corner.on_depth_edge = true;
  const Observation outline = observation_of(corner, 1.2, noise, 0.5);
  EXPECT_DOUBLE_EQ(inside.weight, 0.5);
  EXPECT_DOUBLE_EQ(outline.weight, noise.edge_weight);
  EXPECT_LT(outline.weight, inside.weight);
  // What is hardly trusted to stand still is not trusted less for being an outline.
  EXPECT_DOUBLE_EQ(observation_of(corner, 1.2, noise, 0.05).weight, 0.05);
  EXPECT_EQ(outline.sigma_px, inside.sigma_px);
  EXPECT_EQ(outline.sigma_depth_m, inside.sigma_depth_m);
}

TEST(ObservationNoise, OnAPlaneTheDepthIsTrustedMore) {
  Feature corner{};
  corner.ideal_px.setZero();
  corner.depth_m = 2.0F;
  const NoiseConfig noise;
  const Observation alone = observation_of(corner, 1.2, noise, 0.5);
  corner.on_plane = true;
  const Observation on_plane = observation_of(corner, 1.2, noise, 0.5);
  EXPECT_LT(on_plane.sigma_depth_m, alone.sigma_depth_m);
  EXPECT_EQ(on_plane.sigma_px, alone.sigma_px);
  EXPECT_EQ(on_plane.weight, alone.weight);
}

}  // namespace
}  // namespace ygslam
