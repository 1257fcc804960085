#include "motion/motion_consistency.hpp"

#include <algorithm>

#include "core/check.hpp"

namespace ygslam {
namespace {

bool followed(const PointPair& pair) { return pair.p1_px.allFinite() && pair.p2_px.allFinite(); }

std::vector<PointPair> choose_voters(std::span<const PointPair> flow,
                                     std::span<const MotionLabel> previous_label, bool prior) {
  std::vector<PointPair> voters;
  voters.reserve(flow.size());
  for (std::size_t i = 0; i < flow.size(); ++i) {
    if (!followed(flow[i])) continue;
    if (prior && previous_label[i] != MotionLabel::kStatic) continue;
    voters.push_back(flow[i]);
  }
  return voters;
}

MotionVerdict judge(const Mat3& F, const PointPair& pair, const MotionConfig& config) {
  MotionVerdict verdict;
  if (!followed(pair)) return verdict;
  const double distance_px = epipolar_distance_px(F, pair);
  verdict.distance_px = static_cast<float>(std::min(distance_px, 1e6));
  verdict.consistent = distance_px <= config.tau_px;
  if (distance_px > config.limit_tau_px) {
    verdict.label = MotionLabel::kDynamic;
  } else if (verdict.consistent) {
    verdict.label = MotionLabel::kStatic;
  }
  return verdict;
}

}  // namespace

MotionCheck check_motion(std::span<const PointPair> flow,
                         std::span<const MotionLabel> previous_label, const MotionConfig& config,
                         Rng& rng) {
  CHECK(flow.size() == previous_label.size());
  MotionCheck check;
  check.verdict.resize(flow.size());
  const std::vector<PointPair> voters = choose_voters(flow, previous_label, config.prior);
  check.voters = static_cast<int>(voters.size());
  if (check.voters < config.min_static) {
    check.state = CheckState::kTooFewStatic;
    return check;
  }
  const auto fit = fit_fundamental(voters, config.ransac, rng);
  if (!fit) {
    check.state = CheckState::kNoFit;
    return check;
  }
  check.state = CheckState::kDone;
  check.F = fit->F;
  check.inliers = fit->inliers;
  // Half of the voters agreeing is as good as none: a mover may have as many.
  const double share = static_cast<double>(fit->inliers) / check.voters;
  check.fit_quality = std::clamp((share - 0.5) / 0.3, 0.0, 1.0);

  int judged = 0;
  int dynamic = 0;
  for (std::size_t i = 0; i < flow.size(); ++i) {
    check.verdict[i] = judge(fit->F, flow[i], config);
    judged += check.verdict[i].distance_px >= 0 ? 1 : 0;
    dynamic += check.verdict[i].label == MotionLabel::kDynamic ? 1 : 0;
  }
  check.dynamic_share = judged > 0 ? static_cast<double>(dynamic) / judged : 0;
  return check;
}

}  // namespace ygslam
