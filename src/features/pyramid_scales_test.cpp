#include "features/pyramid_scales.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace ygslam {
namespace {

TEST(PyramidScales, AScaleFindsItsOctaveAndTheEndsHold) {
  for (const int levels : {1, 2, 8, 12}) {
    for (const double factor : {1.05, 1.2, 2.0}) {
      const PyramidScales scales(levels, factor);
      ASSERT_EQ(scales.levels(), levels);
      EXPECT_EQ(scales.of(0), 1.0);
      for (int octave = 0; octave < levels; ++octave) {
        EXPECT_EQ(scales.octave_at(scales.of(octave)), octave);
        EXPECT_NEAR(scales.of(octave) * factor, std::pow(factor, octave + 1),
                    1e-9 * scales.of(octave));
      }
      EXPECT_EQ(scales.octave_at(0.01), 0);
      EXPECT_EQ(scales.octave_at(1e9), levels - 1);
    }
  }
}

}  // namespace
}  // namespace ygslam
