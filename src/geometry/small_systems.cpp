#include "geometry/small_systems.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

namespace ygslam {

SymmetricSystem6::SymmetricSystem6(const Mat6& A) : factors_(A) {}
Vec6 SymmetricSystem6::solve(const Vec6& b) const { return factors_.solve(b); }
Mat6 SymmetricSystem6::inverse() const { return factors_.solve(Mat6::Identity()); }
bool SymmetricSystem6::is_decomposed() const { return factors_.info() == Eigen::Success; }
bool SymmetricSystem6::is_positive() const { return factors_.isPositive(); }

Svd3 svd(const Mat3& A) {
  const Eigen::JacobiSVD<Mat3> solver(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {solver.matrixU(), solver.matrixV(), solver.singularValues()};
}

SymmetricEigen3 symmetric_eigen(const Mat3& A) {
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace ygslam
