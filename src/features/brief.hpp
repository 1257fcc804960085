// Oriented BRIEF: orientation by the intensity centroid and 256 rotated binary tests
// (Rublee, Rabaud, Konolige, Bradski 2011).
#pragma once

#include <array>
#include <cstdint>

#include "features/feature.hpp"

namespace ygslam {

/// One binary test: bit = intensity(first) < intensity(second), offsets [px] from the corner.
struct BriefTest {
  std::int8_t u1, v1, u2, v2;
};
/// The tests in the order in which they were selected (tools/learn_brief_pattern.cpp).
extern const std::array<BriefTest, 256> kBriefPattern;

/// Radius of the disc that gives the orientation [px].
inline constexpr int kPatchRadius = 15;
/// The tests reach this far [px]; beyond the image they see its mirrored border.
inline constexpr int kTestRadius = 18;

/// Direction from the corner to the centroid of the intensities in a disc of radius 15, as a unit
/// vector; (1, 0) where the patch has none.
struct Orientation {
  float cosine = 1;
  float sine = 0;
  /// In [0, 2 pi).
  [[nodiscard]] float angle_rad() const;
};
[[nodiscard]] Orientation patch_orientation(const std::uint8_t* pixel, int stride);

/// Evaluates the tests on a smoothed level.
class Brief {
 public:
  explicit Brief(const std::array<BriefTest, 256>& tests = kBriefPattern);
  [[nodiscard]] Descriptor describe(const std::uint8_t* pixel, int stride,
                                    const Orientation& orientation) const;

 private:
  std::array<float, 512> u_;  // first points of the tests, then the second ones
  std::array<float, 512> v_;
};

}  // namespace ygslam
