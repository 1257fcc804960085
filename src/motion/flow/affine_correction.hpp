// Where the camera moved a little otherwise than predicted, the predicted ends of all flow are off
// together: an affine map of the image corrects them.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

namespace ygslam {

/// Affine map from where points were expected to where they were found.
struct AffineCorrection {
  Eigen::Matrix<float, 2, 3> map = Eigen::Matrix<float, 2, 3>::Identity();
  float error_px = 0;  ///< median distance that is left

  [[nodiscard]] Eigen::Vector2f operator()(const Eigen::Vector2f& guess_uv_px) const {
    return map.leftCols<2>() * guess_uv_px + map.col(2);
  }
};

/// Robust fit (iteratively reweighted, Geman-McClure kernel) that leaves points with a motion of
/// their own aside.
/// @param guess_uv_px, found_uv_px the same points, finite. @return nullopt for fewer than 12
/// points or a degenerate layout.
[[nodiscard]] std::optional<AffineCorrection> fit_affine_correction(
    std::span<const Eigen::Vector2f> guess_uv_px, std::span<const Eigen::Vector2f> found_uv_px);

}  // namespace ygslam
