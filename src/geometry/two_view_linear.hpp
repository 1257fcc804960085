// Linear least squares over pairs of points: normalisation, normal matrices, null vectors. Of
// fit_fundamental() alone.
#pragma once

#include <optional>
#include <span>

#include "geometry/epipolar.hpp"

namespace ygslam::two_view {

using Vec9 = Eigen::Matrix<double, 9, 1>;
using Mat9 = Eigen::Matrix<double, 9, 9>;

/// Similarity that moves the centroid to 0 and the mean distance from it to sqrt(2): p -> s (p -
/// c).
struct Normaliser {
  Vec2 centre = Vec2::Zero();
  double scale = 1;

  [[nodiscard]] Vec2 operator()(const Vec2& p) const { return scale * (p - centre); }
  [[nodiscard]] Mat3 matrix() const {
    Mat3 T;
    T << scale, 0, -scale * centre.x(), 0, scale, -scale * centre.y(), 0, 0, 1;
    return T;
  }
};

struct Normalisers {
  Normaliser first, second;
};

/// Both images get the same scale, so that Sampson distances stay proportional to pixels.
/// @return nullopt where all points coincide in either image.
[[nodiscard]] std::optional<Normalisers> make_normalisers(std::span<const PointPair> pairs);

/// The six different entries of (x, y, 1)^T (x, y, 1): xx xy x yy y 1.
[[nodiscard]] inline Vec6 products(double x, double y) {
  Vec6 p;
  p << x * x, x * y, x, y * y, y, 1.0;
  return p;
}

/// Normal matrix of P2^T F P1 = 0, F row by row. A row of that system is the Kronecker product of
/// P2 and P1, so that 36 sums hold all of its 81 entries.
/// @param moments sum over the pairs of products(P2) products(P1)^T, weighted.
[[nodiscard]] Mat9 fundamental_normal_matrix(const Mat6& moments);

/// Unit vector that the matrix shrinks most, as a 3x3 matrix row by row.
[[nodiscard]] std::optional<Mat3> least_vector(const Mat9& normal_matrix);

/// Nearest matrix of rank 2 in the Frobenius norm, accurate to the last digits.
[[nodiscard]] Mat3 nearest_rank_two_exact(const Mat3& F);

}  // namespace ygslam::two_view
