#include "motion/checks/epipolar_check.hpp"

#include <algorithm>

#include "core/check.hpp"

namespace ygslam {
namespace {

bool followed(const PointPair& pair) { return pair.p1_px.allFinite() && pair.p2_px.allFinite(); }

std::vector<PointPair> choose_candidates(std::span<const PointPair> flow,
                                         std::span<const MotionLabel> previous_label, bool prior) {
  std::vector<PointPair> candidates;
  candidates.reserve(flow.size());
  for (std::size_t i = 0; i < flow.size(); ++i) {
    if (!followed(flow[i])) continue;
    if (prior && previous_label[i] != MotionLabel::kStatic) continue;
    candidates.push_back(flow[i]);
  }
  return candidates;
}

EpipolarLabel classify(const Mat3& F, const PointPair& pair, const EpipolarConfig& config) {
  EpipolarLabel result;
  if (!followed(pair)) return result;
  const double distance_px = epipolar_distance_px(F, pair);
  result.distance_px = static_cast<float>(std::min(distance_px, 1e6));
  result.label = distance_px > config.tau_px ? MotionLabel::kDynamic : MotionLabel::kStatic;
  return result;
}

}  // namespace

EpipolarCheck check_epipolar(std::span<const PointPair> flow,
                             std::span<const MotionLabel> previous_label,
                             const EpipolarConfig& config, Rng& rng) {
  CHECK(flow.size() == previous_label.size());
  EpipolarCheck check;
  check.points.resize(flow.size());
  const std::vector<PointPair> candidates = choose_candidates(flow, previous_label, config.prior);
  check.candidates = static_cast<int>(candidates.size());
  if (check.candidates < config.min_static) {
    check.state = CheckState::kTooFewStatic;
    return check;
  }
  const auto fit = fit_fundamental(candidates, config.ransac, rng);
  if (!fit) {
    check.state = CheckState::kNoFit;
    return check;
  }
  check.state = CheckState::kDone;
  check.F = fit->F;
  check.inliers = fit->inliers;
  // Half of the candidates agreeing is as good as none: a mover may have as many.
  const double share = static_cast<double>(fit->inliers) / check.candidates;
  check.fit_quality = std::clamp((share - 0.5) / 0.3, 0.0, 1.0);

  for (std::size_t i = 0; i < flow.size(); ++i) check.points[i] = classify(fit->F, flow[i], config);
  return check;
}

}  // namespace ygslam
