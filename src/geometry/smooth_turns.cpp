#include "geometry/smooth_turns.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

// Farther apart in one step the camera was put somewhere else.
constexpr double kMostTurnMiss_rad = 0.05;
constexpr double kMostPointDistance_m = 10;
constexpr std::size_t kFewestLinked = 30;  // poses, to know a bias from
constexpr int kSettlingRounds = 3;         // weights of poses that fit badly settle
// A gyroscope's bias, which drifts with its temperature, is one for so long; margins hold the ends.
constexpr double kPiece_s = 60, kMargin_s = 5;
constexpr double kBiasStd_radps = 0.02, kMostBias_radps = 0.2;
// Mean square of the corrections in units of what poses may be off by: more, and it is no
// gyroscope, or not of this camera.
constexpr double kMostMisfit = 3;  // of three axes

using WithBias = Eigen::Matrix<double, 3, 4>;  // a vector, and its derivatives by minus the bias

/// Between two corrections of a chain, in the world's axes:
/// after - before = miss (first column) - by_bias (others) bias.
struct TurnLink {
  WithBias miss = WithBias::Zero();
  double information = 0;  ///< 0: there is none
};

TurnLink link_between(const TurningPose& before, const TurningPose& here) {
  if (here.turn_std_rad <= 0) return {};
  const Mat3& R = here.T_world_camera.R();
  const Vec3 miss_rad = so3_log(before.T_world_camera.R() * so3_exp(here.turn_rad) * R.transpose());
  if (miss_rad.norm() > kMostTurnMiss_rad) return {};
  TurnLink link;
  link.miss << miss_rad, seconds_between(here.stamp, before.stamp) * R;
  link.information = 1 / (here.turn_std_rad * here.turn_std_rad);
  return link;
}

/// Least squares over a chain, whose normal equations are tridiagonal (Thomas' algorithm).
/// @param links since the pose before, of all poses but the first. @param weights of the poses.
std::vector<WithBias> turn_corrections(std::span<const TurnLink> links,
                                       std::span<const double> weights) {
  std::vector<double> diagonal(weights.begin(), weights.end());
  std::vector<WithBias> right(weights.size(), WithBias::Zero());
  for (std::size_t i = 0; i < links.size(); ++i) {
    const double information = links[i].information;
    diagonal[i] += information;
    right[i] -= information * links[i].miss;
    const double share = information / diagonal[i];
    diagonal[i + 1] += information - share * information;
    right[i + 1] += information * links[i].miss + share * right[i];
  }
  right.back() /= diagonal.back();
  for (std::size_t i = links.size(); i-- > 0;)
    right[i] = (right[i] + links[i].information * right[i + 1]) / diagonal[i];
  return right;
}

/// That fits the chain best, once each bias has its best corrections.
Vec3 bias_of(std::span<const TurnLink> links, std::span<const WithBias> corrections) {
  Mat3 H = Mat3::Identity() / (kBiasStd_radps * kBiasStd_radps);
  Vec3 g = Vec3::Zero();
  for (std::size_t i = 0; i < links.size(); ++i) {
    const WithBias left = links[i].miss - (corrections[i + 1] - corrections[i]);
    const Mat3 by_bias = links[i].information * links[i].miss.rightCols<3>().transpose();
    H += by_bias * left.rightCols<3>();
    g += by_bias * left.col(0);
  }
  return H.ldlt().solve(g);
}

/// @return none where the turns are not those of this camera.
std::vector<Vec3> robust_corrections(std::span<const TurningPose> chain,
                                     std::span<const TurnLink> links) {
  std::vector<Vec3> found(chain.size(), Vec3::Zero());
  std::vector<double> weights(chain.size());
  double misfit = 0;
  for (int round = 0; round < kSettlingRounds; ++round) {
    for (std::size_t i = 0; i < chain.size(); ++i) {
      const double std_rad = kLastingFactor * std::max(chain[i].std_rad, kLeastTurnStd_rad);
      weights[i] = 1 / (std_rad * std_rad + found[i].squaredNorm());  // Cauchy's
    }
    const std::vector<WithBias> corrections = turn_corrections(links, weights);
    const Vec3 bias_radps = bias_of(links, corrections);
    if (!(bias_radps.norm() < kMostBias_radps)) return {};
    misfit = 0;
    for (std::size_t i = 0; i < chain.size(); ++i) {
      found[i] = corrections[i].col(0) - corrections[i].rightCols<3>() * bias_radps;
      const double std_rad = kLastingFactor * std::max(chain[i].std_rad, kLeastTurnStd_rad);
      misfit += found[i].squaredNorm() / (std_rad * std_rad);
    }
  }
  return misfit < kMostMisfit * static_cast<double>(chain.size()) ? found : std::vector<Vec3>();
}

SE3 with_turn(const TurningPose& pose, const Vec3& correction_world_rad) {
  const SE3& T = pose.T_world_camera;
  const Vec3 turn_rad = T.R().transpose() * correction_world_rad;
  const Vec3 shift_m = pose.distance_m * Vec3(-turn_rad.y(), turn_rad.x(), 0);
  return {T.R() * so3_exp(turn_rad), T.t() + T.R() * shift_m};
}

/// Corrections of poses [begin, end), which turns tie to each other.
void smooth_chain(std::span<const TurningPose> chain, std::span<const TurnLink> links,
                  std::vector<SE3>& smooth) {
  const auto index_at = [&](double t_s) {  // since the chain's first
    const auto at = std::ranges::partition_point(chain, [&](const TurningPose& pose) {
      return seconds_between(pose.stamp, chain.front().stamp) < t_s;
    });
    return static_cast<std::size_t>(at - chain.begin());
  };
  for (double from_s = 0; index_at(from_s) < chain.size(); from_s += kPiece_s) {
    const std::size_t begin = index_at(from_s - kMargin_s), first = index_at(from_s);
    const std::size_t last = index_at(from_s + kPiece_s),
                      end = index_at(from_s + kPiece_s + kMargin_s);
    const auto found = robust_corrections(chain.subspan(begin, end - begin),
                                          links.subspan(begin, end - begin - 1));
    for (std::size_t i = first; i < last; ++i)
      smooth.push_back(found.empty() ? chain[i].T_world_camera
                                     : with_turn(chain[i], found[i - begin]));
  }
}

}  // namespace

std::vector<SE3> smooth_turns(std::span<const TurningPose> path) {
  std::vector<SE3> smooth;
  smooth.reserve(path.size());
  std::vector<TurnLink> links;
  for (std::size_t begin = 0; begin < path.size();) {
    links.clear();
    std::size_t end = begin + 1;
    for (; end < path.size(); ++end) {
      links.push_back(link_between(path[end - 1], path[end]));
      if (links.back().information == 0) break;
    }
    const std::size_t count = end - begin;
    if (count < kFewestLinked) {
      for (; begin < end; ++begin) smooth.push_back(path[begin].T_world_camera);
    } else {
      smooth_chain(path.subspan(begin, count), std::span(links).first(count - 1), smooth);
    }
    begin = end;
  }
  return smooth;
}

double distance_of_points(const Mat6& covariance) {
  // A turn by w about x and a shift by z w along y move points at the distance z alike; about y and
  // along x they do with the other sign. The regression of the one on the other, over both.
  const double turns = covariance(3, 3) + covariance(4, 4);
  const double together = covariance(1, 3) - covariance(0, 4);
  const double distance_m = turns > 0 ? together / turns : 0;
  return std::isfinite(distance_m) ? std::clamp(distance_m, 0.0, kMostPointDistance_m) : 0;
}

}  // namespace ygslam
