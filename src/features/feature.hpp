// ORB features of one frame: where they are, what they look like, how far away.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

namespace ygslam {

/// 256 binary tests (rotated BRIEF; Rublee et al. 2011).
struct Descriptor {
  std::array<std::uint64_t, 4> bits{};
  bool operator==(const Descriptor&) const = default;
};

/// Hamming distance, 0..256.
[[nodiscard]] inline int distance(const Descriptor& a, const Descriptor& b) {
  int sum = 0;
  for (int i = 0; i < 4; ++i) sum += std::popcount(a.bits[i] ^ b.bits[i]);
  return sum;
}

struct Feature {
  Eigen::Vector2f uv_px;     ///< in the recorded image, full resolution
  Eigen::Vector2f ideal_px;  ///< the same without lens distortion
  float depth_m = 0;         ///< 0 = none
  Eigen::Vector2f depth_slope = Eigen::Vector2f::Zero();  ///< change of depth per pixel [m/px]
  float angle_rad = 0;         ///< orientation of the patch, in [0, 2 pi)
  float response = 0;          ///< corner strength
  std::uint8_t octave = 0;     ///< pyramid level
  bool on_depth_edge = false;  ///< what is seen there is an outline, not a point of a surface
  bool on_plane = false;       ///< depth_m is that of a plane about it, see plane_depth_at()
};

/// All features of a frame; index i of both vectors belongs together. Never changes once made.
struct Features {
  std::vector<Feature> points;
  std::vector<Descriptor> descriptors;
  [[nodiscard]] std::size_t size() const { return points.size(); }
};
using FeaturesPtr = std::shared_ptr<const Features>;

}  // namespace ygslam
