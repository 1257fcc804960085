// The square of an image that Lucas-Kanade moves as one: its pixels and gradients, and how far it
// is off another image. Fixed point, so that every processor gets the same.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace ygslam {

class PaddedImage;

class FlowPatch {
 public:
  /// @param window_px side of the square, odd, >= 3.
  explicit FlowPatch(int window_px);

  /// Takes the square about a point of the image, interpolated bilinearly, and its gradients
  /// (Scharr's 3x3 kernel).
  /// @param centre_px see is_in_reach().
  void take(const PaddedImage& image, const Eigen::Vector2f& centre_px);

  /// Smaller eigenvalue of the mean of g g^T, g the gradient in units of 32 grey levels per pixel:
  /// the measure of Shi and Tomasi (1994), scaled as FlowConfig::min_eigenvalue.
  [[nodiscard]] float min_eigenvalue() const { return min_eigenvalue_; }

  /// Root mean square of the gradient along one axis [grey levels per pixel].
  [[nodiscard]] float mean_gradient() const { return mean_gradient_; }

  /// Gauss-Newton step [px] that brings the square at at_px of another image nearer to this one
  /// (Lucas and Kanade 1981). The gradients are those of the square taken, so that the normal
  /// matrix stays the same in all steps (inverse composition: Baker and Matthews 2004).
  [[nodiscard]] Eigen::Vector2f step(const PaddedImage& image, const Eigen::Vector2f& at_px) const;

  struct Difference {
    float window = 0;  ///< of the whole square
    float centre = 0;  ///< of the 3x3 pixels in its middle
  };
  /// Mean absolute difference to the square at at_px of another image [grey levels].
  [[nodiscard]] Difference difference(const PaddedImage& image, const Eigen::Vector2f& at_px) const;

  /// True if a square about the point can be read: at most a pixel outside the image.
  [[nodiscard]] static bool is_in_reach(const PaddedImage& image, const Eigen::Vector2f& at_px);
  /// Border that images need for squares of this side.
  [[nodiscard]] static int reach_px(int window_px);

 private:
  void measure_gradients();

  int window_px_;
  int half_px_;
  int stride_;                         // entries per row of the buffers, a multiple of 16
  std::vector<std::int16_t> around_;   // the square and a pixel on each side, 1/64 grey level
  std::vector<std::int16_t> gx_, gy_;  // 1/32 grey level per pixel, 0 beyond the square
  std::vector<std::int16_t> inside_;   // a row: 1 in the square, 0 beyond
  Eigen::Matrix2f step_from_sums_;
  float min_eigenvalue_ = 0;
  float mean_gradient_ = 0;
};

}  // namespace ygslam
