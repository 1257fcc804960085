// Decompositions of small matrices that several modules need, compiled once: each costs a file that
// calls Eigen for it seconds of compiling.
#pragma once

#include <Eigen/Cholesky>

#include "geometry/se3.hpp"

namespace ygslam {

/// A x = b for a symmetric A, by LDL^T with pivoting.
class SymmetricSystem6 {
 public:
  explicit SymmetricSystem6(const Mat6& A);
  /// Not finite where A is singular or not finite.
  [[nodiscard]] Vec6 solve(const Vec6& b) const;
  [[nodiscard]] Mat6 inverse() const;
  [[nodiscard]] bool is_decomposed() const;
  /// No negative pivot.
  [[nodiscard]] bool is_positive() const;

 private:
  Eigen::LDLT<Mat6> factors_;
};

/// A = U diag(s) V^T, largest singular value first.
struct Svd3 {
  Mat3 U, V;
  Vec3 s;
};
[[nodiscard]] Svd3 svd(const Mat3& A);

/// Of a symmetric matrix, least value first; its vector is the column of the same number.
struct SymmetricEigen3 {
  Vec3 values;
  Mat3 vectors;
};
[[nodiscard]] SymmetricEigen3 symmetric_eigen(const Mat3& A);

}  // namespace ygslam
