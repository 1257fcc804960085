// How well a camera motion agrees with depth alone: the depth of an earlier frame, moved to the
// current one, against what is measured there. Depth does not see what is painted on a surface, or
// shown on a screen.
#pragma once

#include <vector>

#include "geometry/camera.hpp"
#include "image/image.hpp"

namespace ygslam {

/// Points of a depth image on a coarse grid, in its camera's frame.
class DepthSamples {
 public:
  DepthSamples() = default;
  static constexpr int kColumns = 32;
  DepthSamples(const Camera& camera, const DepthImage& depth_m, int columns = kColumns);
  [[nodiscard]] const std::vector<Vec3>& points() const { return p_camera_; }
  [[nodiscard]] bool empty() const { return p_camera_.empty(); }

 private:
  std::vector<Vec3> p_camera_;
};

struct DepthAgreement {
  int samples = 0;  ///< that fall onto measured depth
  int off = 0;      ///< of them, more than three sigma from it
  double cost = 0;  ///< sum of squared residuals in sigma, each cut off at three sigma
  /// Normal equations of the samples that agree, in the twist of a left perturbation (point to
  /// plane; Chen, Medioni 1992).
  Mat6 information = Mat6::Zero();
  Vec6 gradient = Vec6::Zero();

  /// Cost per sample, 0..9.
  [[nodiscard]] double mean_cost() const { return samples > 0 ? cost / samples : 0; }
  /// How much the cost would fall at most if the camera stood elsewhere.
  [[nodiscard]] double possible_gain() const;
};

[[nodiscard]] DepthAgreement compare_depth(const Camera& camera, const DepthSamples& before,
                                           const DepthImage& current_depth_m,
                                           const SE3& T_current_before);

}  // namespace ygslam
