#include "eval/hand_eye.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/statistics.hpp"
#include "eval/alignment.hpp"
#include "geometry/small_systems.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kMotionPoses = 30;  // a second of video: the RPE's interval
constexpr std::size_t kMostMotions = 2000, kLeastMotions = 30;
constexpr int kIterations = 15;
constexpr std::size_t kBlocks = 4;
constexpr double kClearlyBetter = 1.0 / 3, kNotWorse = 1.1;
constexpr double kLeastTurn_deg = 0.1, kLeastOffset_m = 1e-3;  // what is worth a word
constexpr double kCertain_rad = 5 * std::numbers::pi / 180;
constexpr double kCertain_m = 0.1;
constexpr double kRounding = 1e-9;     // of residuals, so that a perfect fit has a scale
constexpr double kHalfTurn_rad = 3.0;  // beyond, the sign of a rotation vector is a matter of luck

double middle(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return sorted_median(values);
}

// Cauchy weights with twice the median residual as scale.
std::vector<double> cauchy_weights(const std::vector<double>& residuals) {
  const double scale = 2 * middle(residuals) + kRounding;
  std::vector<double> weights;
  for (const double r : residuals) weights.push_back(1 / (1 + (r / scale) * (r / scale)));
  return weights;
}

struct RotationFit {
  Mat3 R = Mat3::Identity();
  double median_rad = 0;         ///< residual
  Vec3 spread = Vec3::Zero();    ///< singular values of the mean of w_A w_B^T, largest first
  Mat3 axes = Mat3::Identity();  ///< of the body's rotation vectors
};

struct RotationVectors {
  std::vector<Vec3> body, camera;
};

RotationVectors rotation_vectors(std::span<const BodyMotion> motions) {
  RotationVectors vectors;
  for (const BodyMotion& motion : motions) {
    const Vec3 a = so3_log(motion.body.R()), b = so3_log(motion.camera.R());
    if (std::max(a.norm(), b.norm()) > kHalfTurn_rad) continue;
    vectors.body.push_back(a);
    vectors.camera.push_back(b);
  }
  return vectors;
}

// w_A = R w_B.
RotationFit fit_rotation(const RotationVectors& vectors) {
  RotationFit fit;
  const std::size_t n = vectors.body.size();
  std::vector<double> weights(n, 1.0), residuals(n);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Mat3 sum = Mat3::Zero();
    double total = 0;
    for (std::size_t i = 0; i < n; ++i) {
      sum += weights[i] * vectors.body[i] * vectors.camera[i].transpose();
      total += weights[i];
    }
    const Svd3 parts = svd(sum / total);
    Vec3 S = Vec3::Ones();
    if (parts.U.determinant() * parts.V.determinant() < 0) S.z() = -1;
    fit.R = parts.U * S.asDiagonal() * parts.V.transpose();
    fit.spread = parts.s;
    fit.axes = parts.U;
    for (std::size_t i = 0; i < n; ++i)
      residuals[i] = (vectors.body[i] - fit.R * vectors.camera[i]).norm();
    weights = cauchy_weights(residuals);
  }
  fit.median_rad = middle(residuals);
  return fit;
}

// One axis only: R = exp(angle axis) R0 with cosine and sine of the angle, and the offset, linear
// in (R_A - I) t - cos u - sin (axis x u) = parallel - t_A, where u + parallel = R0 t_B.
std::optional<Mat3> turn_about_axis(std::span<const BodyMotion> motions, const Mat3& R0,
                                    const Vec3& axis, double overlap) {
  Eigen::Matrix<double, 5, 5> N = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> d = Eigen::Matrix<double, 5, 1>::Zero();
  double squares = 0;
  for (const BodyMotion& motion : motions) {
    const Vec3 v = R0 * motion.camera.t();
    const Vec3 parallel = axis * axis.dot(v);
    Eigen::Matrix<double, 3, 5> J;
    J << motion.body.R() - Mat3::Identity(), parallel - v, -axis.cross(v);
    const Vec3 b = parallel - motion.body.t();
    N += J.transpose() * J;
    d += J.transpose() * b;
    squares += b.squaredNorm();
  }
  N.topLeftCorner<3, 3>() += 1e-9 * N.trace() * Mat3::Identity() + kRounding * Mat3::Identity();
  const Eigen::Matrix<double, 5, 1> x = N.ldlt().solve(d);
  const double variance =
      std::max(squares - x.dot(d), 0.0) / (3 * static_cast<double>(motions.size()));
  const Eigen::Matrix<double, 5, 5> covariance =
      variance * overlap * N.ldlt().solve(Eigen::Matrix<double, 5, 5>::Identity());
  const double sigma_rad = std::sqrt(std::max(covariance(3, 3), covariance(4, 4)));
  if (!(sigma_rad < kCertain_rad) || std::hypot(x[3], x[4]) < 0.5) return std::nullopt;
  return Eigen::AngleAxisd(std::atan2(x[4], x[3]), axis).toRotationMatrix() * R0;
}

// Small-angle covariance of Wahba's problem: s^2 / (n (d_i + d_j)) about the third axis.
double sigma_rad(const RotationFit& fit, double spread, double independent) {
  return fit.median_rad / std::sqrt(3 * independent * (spread + kRounding * kRounding));
}

bool shows_two_axes(const RotationFit& fit, double independent) {
  return sigma_rad(fit, fit.spread[1], independent) < kCertain_rad &&
         fit.spread[1] > 1e-6 * fit.spread[0];
}

std::optional<Mat3> solve_turn(std::span<const BodyMotion> motions, double overlap) {
  const RotationVectors vectors = rotation_vectors(motions);
  if (vectors.body.size() < 3) return std::nullopt;
  const RotationFit fit = fit_rotation(vectors);
  const double independent = static_cast<double>(vectors.body.size()) / overlap;
  if (!(sigma_rad(fit, fit.spread[0], independent) < kCertain_rad)) return std::nullopt;
  if (shows_two_axes(fit, independent)) return fit.R;
  return turn_about_axis(motions, fit.R, fit.axes.col(0), overlap);
}

Vec3 solve_offset(std::span<const BodyMotion> motions, const Mat3& R, double overlap) {
  std::vector<double> weights(motions.size(), 1.0), residuals(motions.size());
  Vec3 t = Vec3::Zero();
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Mat3 N = Mat3::Zero();
    Vec3 d = Vec3::Zero();
    double squares = 0, total = 0;
    for (std::size_t i = 0; i < motions.size(); ++i) {
      const Mat3 J = motions[i].body.R() - Mat3::Identity();
      const Vec3 b = R * motions[i].camera.t() - motions[i].body.t();
      N += weights[i] * J.transpose() * J;
      d += weights[i] * J.transpose() * b;
      squares += weights[i] * (J * t - b).squaredNorm();
      total += weights[i];
    }
    const SymmetricEigen3 eigen = symmetric_eigen(N);
    const double variance = squares / (3 * total) * overlap;
    t.setZero();
    for (int k = 0; k < 3; ++k) {
      const Vec3 axis = eigen.vectors.col(k);
      if (eigen.values[k] < 1e-9 * eigen.values[2] + kRounding * kRounding) continue;
      const double length_m = axis.dot(d) / eigen.values[k];
      const double sigma_m = std::sqrt(variance / eigen.values[k]);
      if (iteration + 1 < kIterations || sigma_m < kCertain_m) t += length_m * axis;
    }
    for (std::size_t i = 0; i < motions.size(); ++i) {
      const BodyMotion& motion = motions[i];
      residuals[i] = (motion.body * t - t - R * motion.camera.t()).norm();
    }
    weights = cauchy_weights(residuals);
  }
  return t;
}

// (X^-1 A X)^-1 B: what is left of a motion's error.
SE3 residual_motion(const BodyMotion& motion, const SE3& X) {
  return (X.inverse() * motion.body * X).inverse() * motion.camera;
}

struct MotionErrors {
  std::vector<double> rot_rad, trans_m;
  void add(const SE3& error) {
    rot_rad.push_back(error.angle());
    trans_m.push_back(error.t().norm());
  }
};

std::size_t motion_poses(const PosePairs& pairs) {
  return std::clamp<std::size_t>(pairs.size() / 8, 1, kMotionPoses);
}

// How many of the motions lie within one.
double overlap_of(const PosePairs& pairs, std::size_t motions) {
  const double poses = static_cast<double>(pairs.size());
  return std::max(1.0,
                  static_cast<double>(motion_poses(pairs)) * static_cast<double>(motions) / poses);
}

/// What is left of the motions' errors where the bodies' constant transform is known.
struct Disagreement {
  double rot_rad = std::numeric_limits<double>::infinity();
  double trans_m = std::numeric_limits<double>::infinity();

  /// In rotation or translation, as far as that is worth a word, and in the other no worse.
  [[nodiscard]] bool is_far_below(const Disagreement& other) const {
    constexpr double kLeast_rad = 0.5 * std::numbers::pi / 180;
    constexpr double kLeast_m = 5e-3;
    const bool clear = (other.rot_rad > kLeast_rad && rot_rad < kClearlyBetter * other.rot_rad) ||
                       (other.trans_m > kLeast_m && trans_m < kClearlyBetter * other.trans_m);
    return clear && rot_rad <= kNotWorse * other.rot_rad + kRounding &&
           trans_m <= kNotWorse * other.trans_m + kRounding;
  }
};

Disagreement disagreement(std::span<const BodyMotion> motions, const SE3& X) {
  MotionErrors errors;
  for (const BodyMotion& motion : motions) errors.add(residual_motion(motion, X));
  return {middle(errors.rot_rad), middle(errors.trans_m)};
}

/// With the best transform; infinite where the motion shows none.
Disagreement best_disagreement(const PosePairs& pairs) {
  const std::vector<BodyMotion> motions = motions_of(pairs);
  const auto X = solve_hand_eye(motions, overlap_of(pairs, motions.size()));
  return X ? disagreement(motions, *X) : Disagreement{};
}

}  // namespace

std::optional<SE3> solve_hand_eye(std::span<const BodyMotion> motions, double overlap) {
  const auto R = solve_turn(motions, overlap);
  if (!R) return std::nullopt;
  return SE3(*R, solve_offset(motions, *R, overlap));
}

std::vector<BodyMotion> motions_of(const PosePairs& pairs) {
  const std::size_t over = motion_poses(pairs);
  std::vector<BodyMotion> motions;
  if (pairs.size() <= over) return motions;
  const std::size_t count = pairs.size() - over;
  const std::size_t taken = std::min(count, kMostMotions);
  for (std::size_t k = 0; k < taken; ++k) {
    const std::size_t i = k * count / taken;
    motions.push_back(
        {pairs.truth[i].T_world_camera.inverse() * pairs.truth[i + over].T_world_camera,
         pairs.estimate[i].T_world_camera.inverse() * pairs.estimate[i + over].T_world_camera});
  }
  return motions;
}

std::optional<SE3> find_body_offset(const PosePairs& pairs) {
  const std::vector<BodyMotion> motions = motions_of(pairs);
  if (motions.size() < kLeastMotions) return std::nullopt;
  const double overlap = overlap_of(pairs, motions.size());
  const auto X = solve_hand_eye(motions, overlap);
  if (!X ||
      (X->angle() * 180 / std::numbers::pi < kLeastTurn_deg && X->t().norm() < kLeastOffset_m))
    return std::nullopt;
  MotionErrors as_given, predicted;
  for (std::size_t block = 0; block < kBlocks; ++block) {
    const auto begin =
        motions.begin() + static_cast<std::ptrdiff_t>(block * motions.size() / kBlocks);
    const auto end =
        motions.begin() + static_cast<std::ptrdiff_t>((block + 1) * motions.size() / kBlocks);
    std::vector<BodyMotion> others(motions.begin(), begin);
    others.insert(others.end(), end, motions.end());
    const auto X_others = solve_hand_eye(others, overlap);
    if (!X_others) return std::nullopt;
    for (auto motion = begin; motion != end; ++motion) {
      as_given.add(residual_motion(*motion, SE3()));
      predicted.add(residual_motion(*motion, *X_others));
    }
  }
  const double rot = middle(predicted.rot_rad), trans = middle(predicted.trans_m);
  const double rot_given = middle(as_given.rot_rad), trans_given = middle(as_given.trans_m);
  const bool clear = rot < kClearlyBetter * rot_given || trans < kClearlyBetter * trans_given;
  const bool no_worse =
      rot <= kNotWorse * rot_given + kRounding && trans <= kNotWorse * trans_given + kRounding;
  return clear && no_worse ? X : std::nullopt;
}

bool is_mirrored(const PosePairs& pairs) {
  const std::vector<BodyMotion> motions = motions_of(pairs);
  if (motions.size() < kLeastMotions) return false;
  const RotationVectors vectors = rotation_vectors(motions);
  if (vectors.body.size() < kLeastMotions) return false;
  const RotationFit fit = fit_rotation(vectors);
  if (!shows_two_axes(fit,
                      static_cast<double>(vectors.body.size()) / overlap_of(pairs, motions.size())))
    return false;
  std::vector<double> same, opposite;
  for (const BodyMotion& motion : motions) {
    const Vec3 t_body = fit.R * motion.camera.t();
    same.push_back((motion.body.t() - t_body).norm());
    opposite.push_back((motion.body.t() + t_body).norm());
  }
  return middle(opposite) < kClearlyBetter * middle(same);
}

std::vector<StampedPose> mirrored(std::span<const StampedPose> poses) {
  const Vec3 M(1, -1, 1);
  std::vector<StampedPose> turned(poses.begin(), poses.end());
  for (StampedPose& pose : turned) {
    const Mat3 R = M.asDiagonal() * pose.T_world_camera.R() * M.asDiagonal();
    pose.T_world_camera = SE3(R, M.cwiseProduct(pose.T_world_camera.t()));
  }
  return turned;
}

std::vector<StampedPose> read_otherwise(std::span<const StampedPose> poses, PoseReading reading) {
  std::vector<StampedPose> read(poses.begin(), poses.end());
  for (StampedPose& pose : read) {
    SE3& T = pose.T_world_camera;
    const Eigen::Quaterniond q = T.quaternion();
    if (reading == PoseReading::kWFirst ||
        reading == PoseReading::kInverseWFirst)  // qw was read as qx, qx as qy, ...
      T = SE3(Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()), T.t());
    if (reading == PoseReading::kWLast)  // and the other way round
      T = SE3(Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), T.t());
    if (reading == PoseReading::kInverse || reading == PoseReading::kInverseWFirst) T = T.inverse();
  }
  return read;
}

namespace {

/// Whether a reading has w at another end than the file was read with, or says nothing of that.
bool is_other_order(PoseReading reading, bool was_w_first) {
  if (reading == PoseReading::kInverse) return true;
  return (reading == PoseReading::kWLast) == was_w_first;
}

}  // namespace

BetterReading better_reading(const PosePairs& pairs, WFirst w_first) {
  const std::vector<BodyMotion> motions = motions_of(pairs);
  if (motions.size() < kLeastMotions) return {};
  const Disagreement plain = disagreement(motions, SE3());
  const Disagreement solved = best_disagreement(pairs);
  const Disagreement given = {std::min(plain.rot_rad, solved.rot_rad),
                              std::min(plain.trans_m, solved.trans_m)};
  BetterReading best;
  // Translations tell readings apart better than turns do. That of a mirror is told elsewhere.
  double least = best_disagreement({mirrored(pairs.truth), pairs.estimate}).trans_m;
  for (const PoseReading reading : {PoseReading::kWFirst, PoseReading::kWLast,
                                    PoseReading::kInverse, PoseReading::kInverseWFirst}) {
    Disagreement of_truth, of_estimate;
    if (is_other_order(reading, w_first.truth))
      of_truth = best_disagreement({read_otherwise(pairs.truth, reading), pairs.estimate});
    if (is_other_order(reading, w_first.estimate))
      of_estimate = best_disagreement({pairs.truth, read_otherwise(pairs.estimate, reading)});
    const double trans_m = std::min(of_truth.trans_m, of_estimate.trans_m);
    constexpr double kAsGood = 4;
    const BetterReading found = {
        reading, of_truth.is_far_below(given) && of_truth.trans_m < kAsGood * trans_m,
        of_estimate.is_far_below(given) && of_estimate.trans_m < kAsGood * trans_m};
    if (trans_m >= least || !(found.fits_truth || found.fits_estimate)) continue;
    best = found;
    least = trans_m;
  }
  return best;
}

std::vector<StampedPose> truth_of_camera(std::span<const StampedPose> truth,
                                         std::span<const StampedPose> estimate, double max_diff_s) {
  std::vector<StampedPose> poses(truth.begin(), truth.end());
  const auto X = find_body_offset(associate(truth, estimate, max_diff_s));
  if (!X) return poses;
  for (StampedPose& pose : poses) pose.T_world_camera = pose.T_world_camera * *X;
  return poses;
}

}  // namespace ygslam
