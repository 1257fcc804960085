// Epipolar geometry of two views: the fundamental matrix and how far a match is from obeying it.
//
// Convention (the paper's eq. 10): P2^T F P1 = 0 with P1 the homogeneous ideal pixel in the first
// (previous) image and P2 its match in the second (current). F has seven degrees of freedom: nine
// entries, less scale, less det F = 0. (The paper's text says five, and its eqs. 11 and 13
// transpose F against eq. 10.)
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/rng.hpp"
#include "geometry/camera.hpp"
#include "geometry/ransac.hpp"
#include "geometry/se3.hpp"

namespace ygslam {

/// A point seen in two images [ideal px].
struct PointPair {
  Vec2 p1_px = Vec2::Zero();  ///< in the first image
  Vec2 p2_px = Vec2::Zero();  ///< in the second image
};

struct FundamentalFit {
  Mat3 F = Mat3::Zero();             ///< rank 2, Frobenius norm 1
  std::vector<std::uint8_t> inlier;  ///< 1 per pair within threshold_px (Sampson distance)
  int inliers = 0;
  int iterations = 0;
};

/// Distance [px] of p2 from the epipolar line of p1 in the second image; the paper's eqs. (15),
/// (16). Infinity where F maps p1 to no line (p1 is the epipole) or an input is not finite.
[[nodiscard]] double epipolar_distance_px(const Mat3& F, const PointPair& pair);

/// F by RANSAC over eight-point samples (Hartley 1997), scored by the truncated Sampson error
/// (Hartley & Zisserman 2nd ed., eq. 11.9; MSAC, Torr and Zisserman 2000), each new best refitted
/// to its inliers (Chum et al. 2003).
/// Pairs that are not finite count as outliers.
/// @return nullopt if fewer than config.min_inliers (at least eight) agree. In pure rotation and on
/// a single plane F is not unique: a fit that explains the inliers comes back all the
/// same.
[[nodiscard]] std::optional<FundamentalFit> fit_fundamental(std::span<const PointPair> pairs,
                                                            const RansacConfig& config, Rng& rng);

/// F of two views of one camera, with Frobenius norm 1. T_2_1 takes points from the first camera's
/// frame to the second's. Zero where the cameras coincide.
[[nodiscard]] Mat3 fundamental_from_pose(const Camera& camera, const SE3& T_2_1);

}  // namespace ygslam
