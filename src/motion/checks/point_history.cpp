#include "motion/checks/point_history.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"
#include "core/statistics.hpp"

namespace ygslam {
namespace {

constexpr double kMostHistoryLimits = 2.0;  // bad poses stretch the limit no further

}  // namespace

HistoryCheck PointHistory::check(const Camera& camera, std::span<const FollowedPoint> points,
                                 std::span<const std::uint8_t> candidate,
                                 const SE3& T_current_newest) const {
  CHECK(points.size() == candidate.size());
  HistoryCheck result;
  result.residual.resize(points.size());
  result.limit_px = config_.limit_px;
  const Pose* newest = pose_of(newest_);
  if (!config_.enabled || !newest || chains_.size() != points.size()) return result;
  const SE3 T_current_odom = T_current_newest * newest->T_camera_odom;
  std::vector<double> of_candidates_px;
  of_candidates_px.reserve(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    result.residual[k] = residual_of(camera, chains_[k], points[k], T_current_odom);
    const double own_px = result.residual[k].px.own_depth_px;
    if (candidate[k] && points[k].depth_m > 0 && own_px >= 0) of_candidates_px.push_back(own_px);
  }
  if (of_candidates_px.empty()) return result;
  result.limit_px = std::clamp(config_.limit_medians * median(of_candidates_px), config_.limit_px,
                               kMostHistoryLimits * config_.limit_px);
  return result;
}

HistoryResidual PointHistory::residual_of(const Camera& camera, const Chain& chain,
                                          const FollowedPoint& point,
                                          const SE3& T_current_odom) const {
  for (int a = 0; a < chain.size; ++a) {
    const Sample& sample = chain.samples[a];
    const int age = newest_ + 1 - sample.frame;
    if (age < config_.min_age_frames) break;
    const Pose* then = pose_of(sample.frame);
    if (!then) continue;
    const FollowedPoint seen{sample.ideal_px.cast<double>(), point.current_px, sample.depth_m,
                             sample.range};
    return {ego_motion_residual(camera, T_current_odom * then->T_camera_odom.inverse(), seen), age};
  }
  return {};
}

void PointHistory::push(std::span<const FollowedPoint> points, std::span<const std::int32_t> link,
                        const SE3& T_camera_odom) {
  CHECK(points.size() == link.size());
  ++newest_;
  poses_.push_back({newest_, T_camera_odom});
  while (static_cast<int>(poses_.size()) > kSamples * config_.spacing_frames + 1)
    poses_.pop_front();
  std::vector<Chain> chains(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    Chain& chain = chains[i];
    if (link[i] >= 0 && link[i] < std::ssize(chains_)) chain = chains_[link[i]];
    const bool due =
        chain.size == 0 || newest_ - chain.samples[chain.size - 1].frame >= config_.spacing_frames;
    if (!due) continue;
    if (chain.size == kSamples) {
      std::move(chain.samples.begin() + 1, chain.samples.end(), chain.samples.begin());
      --chain.size;
    }
    chain.samples[chain.size++] = {newest_, points[i].previous_px.cast<float>(),
                                   static_cast<float>(points[i].depth_m), points[i].range};
  }
  chains_ = std::move(chains);
}

const PointHistory::Pose* PointHistory::pose_of(std::int32_t frame) const {
  if (poses_.empty() || frame < poses_.front().frame || frame > newest_) return nullptr;
  return &poses_[static_cast<std::size_t>(frame - poses_.front().frame)];
}

void PointHistory::clear() {
  chains_.clear();
  poses_.clear();
}

}  // namespace ygslam
