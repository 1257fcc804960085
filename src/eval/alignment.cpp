#include "eval/alignment.hpp"

#include <array>
#include <cmath>

#include "core/check.hpp"
#include "geometry/small_systems.hpp"

namespace ygslam {
namespace {

constexpr std::array<std::pair<std::string_view, AlignMode>, 4> kNames = {{
    {"se3", AlignMode::kSe3},
    {"sim3", AlignMode::kSim3},
    {"first", AlignMode::kFirst},
    {"none", AlignMode::kNone},
}};

using Points = Eigen::Matrix3Xd;

Points positions(const std::vector<StampedPose>& poses) {
  Points points(3, static_cast<Eigen::Index>(poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    points.col(static_cast<Eigen::Index>(i)) = poses[i].T_world_camera.t();
  }
  return points;
}

// The static camera: nothing to turn by.
Alignment align_centroids(const Vec3& truth_mean, const Vec3& estimate_mean) {
  Alignment alignment;
  alignment.T_truth_estimate = {Mat3::Identity(), truth_mean - estimate_mean};
  alignment.truth_without_extent = true;
  return alignment;
}

Alignment align_positions(const Points& truth, const Points& estimate, bool with_scale) {
  const auto n = static_cast<double>(truth.cols());
  const Vec3 truth_mean = truth.rowwise().mean();
  const Vec3 estimate_mean = estimate.rowwise().mean();
  const Points q = truth.colwise() - truth_mean;
  const Points p = estimate.colwise() - estimate_mean;
  if (std::sqrt(q.squaredNorm() / n) < kNoExtent_m) {
    return align_centroids(truth_mean, estimate_mean);
  }
  const Mat3 covariance = q * p.transpose() / n;  // eq. (38)
  const Svd3 parts = svd(covariance);
  Vec3 S = Vec3::Ones();  // eqs. (39), (43)
  if (parts.U.determinant() * parts.V.determinant() < 0) S.z() = -1.0;
  const Mat3 R = parts.U * S.asDiagonal() * parts.V.transpose();  // eq. (40)
  const double variance = p.squaredNorm() / n;
  Alignment alignment;
  if (with_scale && variance > 0) {
    alignment.scale = parts.s.dot(S) / variance;  // eq. (42)
  }
  alignment.T_truth_estimate = {R, truth_mean - alignment.scale * (R * estimate_mean)};  // eq. (41)
  return alignment;
}

}  // namespace

std::optional<AlignMode> parse_align_mode(std::string_view name) {
  for (const auto& [known, mode] : kNames) {
    if (known == name) return mode;
  }
  return std::nullopt;
}

std::string_view name_of(AlignMode mode) {
  for (const auto& [name, known] : kNames) {
    if (known == mode) return name;
  }
  return "?";
}

Alignment align(const PosePairs& pairs, AlignMode mode) {
  CHECK(pairs.size() > 0);
  Alignment alignment;
  switch (mode) {
    case AlignMode::kSe3:
    case AlignMode::kSim3:
      return align_positions(positions(pairs.truth), positions(pairs.estimate),
                             mode == AlignMode::kSim3);
    case AlignMode::kFirst:
      alignment.T_truth_estimate =
          pairs.truth.front().T_world_camera * pairs.estimate.front().T_world_camera.inverse();
      return alignment;
    case AlignMode::kNone:
      return alignment;
  }
  return alignment;
}

Alignment align_with_orientations(const PosePairs& pairs) {
  CHECK(pairs.size() > 0, "alignment without poses");
  Mat3 sum = Mat3::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i)
    sum += pairs.truth[i].T_world_camera.R() * pairs.estimate[i].T_world_camera.R().transpose();
  auto [U, V, s] = svd(sum);
  if ((U * V.transpose()).determinant() < 0) U.col(2) *= -1;
  const Mat3 R = U * V.transpose();
  Vec3 t = Vec3::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i)
    t += pairs.truth[i].T_world_camera.t() - R * pairs.estimate[i].T_world_camera.t();
  Alignment alignment;
  alignment.T_truth_estimate = SE3(R, t / static_cast<double>(pairs.size()));
  return alignment;
}

}  // namespace ygslam
