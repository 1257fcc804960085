#include "geometry/two_view_linear.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "geometry/small_systems.hpp"

namespace ygslam::two_view {

std::optional<Normalisers> make_normalisers(std::span<const PointPair> pairs) {
  if (pairs.empty()) return std::nullopt;
  const auto total = static_cast<double>(pairs.size());
  Normalisers n;
  for (const PointPair& pair : pairs) {
    n.first.centre += pair.p1_px;
    n.second.centre += pair.p2_px;
  }
  n.first.centre /= total;
  n.second.centre /= total;
  double spread1 = 0;
  double spread2 = 0;
  for (const PointPair& pair : pairs) {
    spread1 += (pair.p1_px - n.first.centre).norm();
    spread2 += (pair.p2_px - n.second.centre).norm();
  }
  if (!(std::min(spread1, spread2) > 1e-6 * total) || !std::isfinite(spread1 + spread2))
    return std::nullopt;
  n.first.scale = n.second.scale = 2.0 * std::sqrt(2.0) * total / (spread1 + spread2);
  return n;
}

Mat9 fundamental_normal_matrix(const Mat6& moments) {
  constexpr int kEntry[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};  // of products()
  Mat9 A;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l) A(3 * i + j, 3 * k + l) = moments(kEntry[i][k], kEntry[j][l]);
  return A;
}

std::optional<Mat3> least_vector(const Mat9& normal_matrix) {
  const Eigen::SelfAdjointEigenSolver<Mat9> solver(normal_matrix);
  if (solver.info() != Eigen::Success) return std::nullopt;
  const Vec9 f = solver.eigenvectors().col(0);
  return Mat3(Eigen::Map<const Mat3>(f.data()).transpose());
}

Mat3 nearest_rank_two_exact(const Mat3& F) {
  Svd3 parts = svd(F);
  parts.s(2) = 0;
  return parts.U * parts.s.asDiagonal() * parts.V.transpose();
}

}  // namespace ygslam::two_view
