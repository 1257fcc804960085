#include "dense/surface_sample.hpp"

#include <gtest/gtest.h>

#include "volume/volume_test_world.hpp"

namespace ygslam {
namespace {

constexpr int kStep_px = 8;  // a hole of one step is four voxels wide on the wall

/// A wall straight ahead, and a volume that saw it but where `is_hole` says.
class SurfaceSamples : public ::testing::Test {
 protected:
  template <typename IsHole>
  [[nodiscard]] double share_unseen(IsHole is_hole) const {
    DepthView seen = view_;
    for (int v = 0; v < seen.depth.height(); ++v)
      for (int u = 0; u < seen.depth.width(); ++u)
        if (is_hole(u / kStep_px, v / kStep_px)) seen.depth.at(u, v) = 0;
    Volume volume(config_);
    volume.integrate(seen, SE3());
    return sample_.share_seen_less(1, SE3(), volume.surface());
  }

  VolumeConfig config_;
  DepthView view_ = volume_test::render({}, SE3());
  SurfaceSample sample_{view_, config_.preparation, kStep_px};
  int width_ = view_.depth.width() / kStep_px, height_ = view_.depth.height() / kStep_px;
};

TEST_F(SurfaceSamples, WhatNobodySawIsNewAndWhatWasSeenIsNot) {
  EXPECT_DOUBLE_EQ(sample_.share_seen_less(1, SE3(), Volume(config_).surface()), 1);
  EXPECT_DOUBLE_EQ(share_unseen([](int, int) { return false; }), 0);
}

TEST_F(SurfaceSamples, SinglePixelsAndLinesAreNotNewButAreasAre) {
  EXPECT_DOUBLE_EQ(share_unseen([](int u, int v) { return u % 3 == 1 && v % 3 == 1; }), 0);
  EXPECT_DOUBLE_EQ(share_unseen([](int, int v) { return v == 5; }), 0);
  const double area =
      share_unseen([](int u, int v) { return u >= 6 && u < 11 && v >= 5 && v < 9; });
  EXPECT_DOUBLE_EQ(area, 20.0 / (width_ * height_));
}

TEST_F(SurfaceSamples, AStripAtThePicturesEdgeIsNew) {
  EXPECT_DOUBLE_EQ(share_unseen([this](int u, int) { return u >= width_ - 2; }), 2.0 / width_);
}

}  // namespace
}  // namespace ygslam
