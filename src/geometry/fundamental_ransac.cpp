// fit_fundamental(): random samples, scores and refits.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geometry/epipolar.hpp"
#include "geometry/two_view_linear.hpp"

namespace ygslam {
namespace {

using two_view::fundamental_normal_matrix;
using two_view::least_vector;
using two_view::nearest_rank_two_exact;
using two_view::Normalisers;
using two_view::products;
using two_view::Vec9;

constexpr int kSample = 8;
constexpr int kLocalRefits = 3;  // refits of a new best model
constexpr int kFinalRefits = 5;

/// Row of the eight-point system for P2^T F P1 = 0, F row by row.
Vec9 design_row(const Vec2& p1, const Vec2& p2) {
  Vec9 a;
  a << p2.x() * p1.x(), p2.x() * p1.y(), p2.x(), p2.y() * p1.x(), p2.y() * p1.y(), p2.y(), p1.x(),
      p1.y(), 1.0;
  return a;
}

Mat3 as_matrix(const Vec9& f) {
  Mat3 F;
  F << f(0), f(1), f(2), f(3), f(4), f(5), f(6), f(7), f(8);
  return F;
}

/// Nearest matrix of rank 2, faster than nearest_rank_two_exact(): F - F v v^T, v the last right
/// singular vector.
Mat3 nearest_rank_two(const Mat3& F) {
  Eigen::SelfAdjointEigenSolver<Mat3> solver;
  solver.computeDirect(F.transpose() * F);
  const Vec3 v = solver.eigenvectors().col(0);
  return F - (F * v) * v.transpose();
}

/// A vector of the null space of an 8x9 matrix by elimination with full pivoting; where the rank is
/// below eight, one of the many.
Vec9 null_vector(Eigen::Matrix<double, 8, 9>& A) {
  std::array<int, 9> column{0, 1, 2, 3, 4, 5, 6, 7, 8};
  int rank = 0;
  for (; rank < 8; ++rank) {
    int pivot_row = rank;
    int pivot_col = rank;
    double largest = 0;
    for (int c = rank; c < 9; ++c) {
      for (int r = rank; r < 8; ++r) {
        if (std::abs(A(r, c)) > largest) {
          largest = std::abs(A(r, c));
          pivot_row = r;
          pivot_col = c;
        }
      }
    }
    if (!(largest > 1e-10)) break;
    if (pivot_row != rank) A.row(rank).swap(A.row(pivot_row));
    if (pivot_col != rank) {
      A.col(rank).swap(A.col(pivot_col));
      std::swap(column[rank], column[pivot_col]);
    }
    for (int r = rank + 1; r < 8; ++r) {
      const double factor = A(r, rank) / A(rank, rank);
      for (int c = rank; c < 9; ++c) A(r, c) -= factor * A(rank, c);
    }
  }
  Vec9 x = Vec9::Zero();
  x(rank) = 1;  // the first free unknown
  for (int r = rank - 1; r >= 0; --r) {
    double sum = A(r, rank);
    for (int c = r + 1; c < rank; ++c) sum += A(r, c) * x(c);
    x(r) = -sum / A(r, r);
  }
  Vec9 f;
  for (int c = 0; c < 9; ++c) f(column[c]) = x(c);
  return f;
}

/// The finite pairs in normalised coordinates, laid out for the vector unit.
struct Soa {
  std::vector<float> x1, y1, x2, y2;
  Normalisers normalisers;
  double scale = 1;  // normalised units per pixel

  [[nodiscard]] std::size_t size() const { return x1.size(); }
  [[nodiscard]] Vec2 p1(std::size_t i) const { return {x1[i], y1[i]}; }
  [[nodiscard]] Vec2 p2(std::size_t i) const { return {x2[i], y2[i]}; }
};

std::optional<Soa> make_soa(std::span<const PointPair> pairs) {
  const auto normalisers = two_view::make_normalisers(pairs);
  if (!normalisers) return std::nullopt;
  Soa soa;
  soa.normalisers = *normalisers;
  soa.scale = normalisers->first.scale;
  for (auto* v : {&soa.x1, &soa.y1, &soa.x2, &soa.y2}) v->resize(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Vec2 p1 = normalisers->first(pairs[i].p1_px);
    const Vec2 p2 = normalisers->second(pairs[i].p2_px);
    soa.x1[i] = static_cast<float>(p1.x()), soa.y1[i] = static_cast<float>(p1.y());
    soa.x2[i] = static_cast<float>(p2.x()), soa.y2[i] = static_cast<float>(p2.y());
  }
  return soa;
}

/// Squared Sampson distance of every pair, normalised units.
void sampson_all(const Soa& soa, const Mat3& F, std::vector<float>& error2) {
  const Eigen::Matrix3f f = F.cast<float>();
  const float f00 = f(0, 0), f01 = f(0, 1), f02 = f(0, 2), f10 = f(1, 0), f11 = f(1, 1),
              f12 = f(1, 2), f20 = f(2, 0), f21 = f(2, 1), f22 = f(2, 2);
  const std::size_t n = soa.size();
  const float* x1 = soa.x1.data();
  const float* y1 = soa.y1.data();
  const float* x2 = soa.x2.data();
  const float* y2 = soa.y2.data();
  float* out = error2.data();
  for (std::size_t i = 0; i < n; ++i) {
    const float a = f00 * x1[i] + f01 * y1[i] + f02;
    const float b = f10 * x1[i] + f11 * y1[i] + f12;
    const float c = f20 * x1[i] + f21 * y1[i] + f22;
    const float d = f00 * x2[i] + f10 * y2[i] + f20;
    const float e = f01 * x2[i] + f11 * y2[i] + f21;
    const float r = a * x2[i] + b * y2[i] + c;
    out[i] = r * r / (a * a + b * b + d * d + e * e + 1e-20F);
  }
}

struct Score {
  double cost = std::numeric_limits<double>::infinity();  // MSAC: sum of min(error^2, threshold^2)
  int inliers = 0;
};

Score score(const std::vector<float>& error2, float threshold2) {
  // Eight partial sums, so that the compiler may use the vector unit without reordering a sum.
  std::array<float, 8> cost{};
  std::array<int, 8> inliers{};
  const std::size_t n = error2.size();
  std::size_t i = 0;
  for (; i + 8 <= n; i += 8) {
    for (std::size_t k = 0; k < 8; ++k) {
      const float e = error2[i + k];
      cost[k] += e < threshold2 ? e : threshold2;
      inliers[k] += e < threshold2 ? 1 : 0;
    }
  }
  for (; i < n; ++i) {
    cost[0] += std::min(error2[i], threshold2);
    inliers[0] += error2[i] < threshold2 ? 1 : 0;
  }
  Score s{0, 0};
  for (std::size_t k = 0; k < 8; ++k) s.cost += cost[k], s.inliers += inliers[k];
  return s;
}

/// Least squares on the inliers, each row divided by the length of its gradient under the present
/// F, which turns the algebraic error into Sampson's (Hartley & Zisserman 2nd ed., sec. 11.4).
std::optional<Mat3> refit(const Soa& soa, const Mat3& F, const std::vector<float>& error2,
                          float threshold2) {
  Mat6 moments = Mat6::Zero();
  int used = 0;
  for (std::size_t i = 0; i < soa.size(); ++i) {
    if (!(error2[i] < threshold2)) continue;
    const Vec2 p1 = soa.p1(i);
    const Vec2 p2 = soa.p2(i);
    const Vec2 line2 = F.topLeftCorner<2, 2>() * p1 + F.topRightCorner<2, 1>();
    const Vec2 line1 =
        F.topLeftCorner<2, 2>().transpose() * p2 + F.bottomLeftCorner<1, 2>().transpose();
    const double gradient2 = line1.squaredNorm() + line2.squaredNorm();
    if (!(gradient2 > 1e-18)) continue;
    const Vec6 weighted = products(p2.x(), p2.y()) / gradient2;
    moments.noalias() += weighted * products(p1.x(), p1.y()).transpose();
    ++used;
  }
  if (used < kSample) return std::nullopt;
  const auto solution = least_vector(fundamental_normal_matrix(moments));
  if (!solution) return std::nullopt;
  const Mat3 refined = nearest_rank_two_exact(*solution);
  const double norm = refined.norm();
  if (!(norm > 1e-12) || !std::isfinite(norm)) return std::nullopt;
  return refined / norm;
}

struct Model {
  Mat3 F = Mat3::Zero();
  Score score;
};

/// Refits while that lowers the cost. error2 holds the errors under model.F before and after.
void improve(const Soa& soa, float threshold2, int rounds, Model& model,
             std::vector<float>& error2) {
  std::vector<float> trial2(error2.size());
  for (int round = 0; round < rounds; ++round) {
    const auto F = refit(soa, model.F, error2, threshold2);
    if (!F) return;
    sampson_all(soa, *F, trial2);
    const Score s = score(trial2, threshold2);
    if (!(s.cost < model.score.cost)) return;
    const bool settled = s.cost > 0.999 * model.score.cost;
    model = {*F, s};
    error2.swap(trial2);
    if (settled) return;
  }
}

std::optional<Mat3> fit_sample(const Soa& soa, Rng& rng) {
  const auto sample = draw_sample<kSample>(static_cast<std::uint32_t>(soa.size()), rng);
  Eigen::Matrix<double, 8, 9> A;
  for (int r = 0; r < kSample; ++r)
    A.row(r) = design_row(soa.p1(sample[r]), soa.p2(sample[r])).transpose();
  const Mat3 F = nearest_rank_two(as_matrix(null_vector(A)));
  const double norm = F.norm();
  if (!(norm > 1e-12) || !std::isfinite(norm)) return std::nullopt;
  return Mat3(F / norm);
}

Model search(const Soa& soa, const RansacConfig& config, float threshold2, Rng& rng,
             std::vector<float>& best2, int& iterations) {
  Model best;
  std::vector<float> error2(soa.size());
  best2.assign(soa.size(), std::numeric_limits<float>::infinity());
  int wanted = config.max_iterations;
  for (iterations = 0; iterations < wanted; ++iterations) {
    const auto F = fit_sample(soa, rng);
    if (!F) continue;
    sampson_all(soa, *F, error2);
    const Score s = score(error2, threshold2);
    if (!(s.cost < best.score.cost)) continue;
    best = {*F, s};
    best2.swap(error2);
    improve(soa, threshold2, kLocalRefits, best, best2);
    const double share = static_cast<double>(best.score.inliers) / static_cast<double>(soa.size());
    wanted = ransac_iterations(share, kSample, config.confidence, config.max_iterations);
  }
  return best;
}

}  // namespace

std::optional<FundamentalFit> fit_fundamental(std::span<const PointPair> pairs,
                                              const RansacConfig& config, Rng& rng) {
  std::vector<PointPair> finite;
  std::vector<std::size_t> source;
  finite.reserve(pairs.size());
  source.reserve(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!pairs[i].p1_px.allFinite() || !pairs[i].p2_px.allFinite()) continue;
    finite.push_back(pairs[i]);
    source.push_back(i);
  }
  const int needed = std::max(config.min_inliers, kSample);
  if (finite.size() < static_cast<std::size_t>(needed)) return std::nullopt;
  const auto soa = make_soa(finite);
  if (!soa) return std::nullopt;

  const double threshold = config.threshold_px * soa->scale;
  const auto threshold2 = static_cast<float>(threshold * threshold);
  FundamentalFit fit;
  std::vector<float> error2;
  Model best = search(*soa, config, threshold2, rng, error2, fit.iterations);
  if (best.score.inliers < needed) return std::nullopt;
  improve(*soa, threshold2, kFinalRefits, best, error2);
  fit.F = soa->normalisers.second.matrix().transpose() * best.F * soa->normalisers.first.matrix();
  fit.F /= fit.F.norm();
  if (!fit.F.allFinite()) return std::nullopt;

  fit.inlier.assign(pairs.size(), 0);
  for (std::size_t i = 0; i < error2.size(); ++i) {
    if (!(error2[i] < threshold2)) continue;
    fit.inlier[source[i]] = 1;
    ++fit.inliers;
  }
  return fit;
}

}  // namespace ygslam
