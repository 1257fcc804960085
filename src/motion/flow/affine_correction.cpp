#include "motion/flow/affine_correction.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/check.hpp"
#include "core/statistics.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kMinPoints = 12;
constexpr int kIterations = 6;
constexpr double kFinestScale_px = 0.5;

double median_coordinate(std::span<const Eigen::Vector2f> guess,
                         std::span<const Eigen::Vector2f> found, int axis) {
  std::vector<double> shift(guess.size());
  for (std::size_t i = 0; i < shift.size(); ++i) shift[i] = found[i][axis] - guess[i][axis];
  return median(std::move(shift));
}

}  // namespace

std::optional<AffineCorrection> fit_affine_correction(
    std::span<const Eigen::Vector2f> guess_uv_px, std::span<const Eigen::Vector2f> found_uv_px) {
  CHECK(guess_uv_px.size() == found_uv_px.size());
  if (guess_uv_px.size() < kMinPoints) return std::nullopt;
  using Map = Eigen::Matrix<double, 2, 3>;
  // Start: the median shift, which half of the points may contradict.
  Map map = Map::Identity();
  for (int axis = 0; axis < 2; ++axis)
    map(axis, 2) = median_coordinate(guess_uv_px, found_uv_px, axis);
  std::vector<double> error_px(guess_uv_px.size());
  const auto measure = [&] {
    for (std::size_t i = 0; i < error_px.size(); ++i)
      error_px[i] =
          (map * guess_uv_px[i].cast<double>().homogeneous() - found_uv_px[i].cast<double>())
              .norm();
    return median(std::vector<double>(error_px));  // the errors stay in their order
  };
  double left_px = measure();
  for (int k = 0; k < kIterations; ++k) {
    const double scale2 = std::pow(std::max(2 * left_px, kFinestScale_px), 2);
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Matrix<double, 3, 2> b = Eigen::Matrix<double, 3, 2>::Zero();
    for (std::size_t i = 0; i < error_px.size(); ++i) {
      const Eigen::Vector3d p = guess_uv_px[i].cast<double>().homogeneous();
      const double root = scale2 / (scale2 + error_px[i] * error_px[i]);
      A += root * root * p * p.transpose();
      b += root * root * p * found_uv_px[i].cast<double>().transpose();
    }
    // Points on one line leave the map open.
    if (!(A.topLeftCorner<2, 2>().determinant() > 0)) return std::nullopt;
    const Eigen::LDLT<Eigen::Matrix3d> solver(A);
    if (solver.info() != Eigen::Success || !(solver.rcond() > 1e-12)) return std::nullopt;
    map = solver.solve(b).transpose();
    if (!map.allFinite()) return std::nullopt;
    left_px = measure();
  }
  return AffineCorrection{map.cast<float>(), static_cast<float>(left_px)};
}

}  // namespace ygslam
