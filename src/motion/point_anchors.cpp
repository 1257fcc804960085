#include "motion/point_anchors.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"

namespace ygslam {
namespace {

constexpr double kMostAnchorLimits = 2.0;  // bad poses stretch the limit no further

}  // namespace

AnchorJudgement PointAnchors::judge(const Camera& camera, std::span<const RigidPoint> points,
                                    std::span<const std::uint8_t> voter,
                                    const SE3& T_current_newest) const {
  CHECK(points.size() == voter.size());
  AnchorJudgement result;
  result.residual.resize(points.size());
  result.limit_px = config_.limit_px;
  const Pose* newest = pose_of(newest_);
  if (!config_.enabled || !newest || chains_.size() != points.size()) return result;
  const SE3 T_current_odom = T_current_newest * newest->T_camera_odom;
  std::vector<double> of_voters_px;
  of_voters_px.reserve(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    result.residual[k] = judge_one(camera, chains_[k], points[k], T_current_odom);
    const double own_px = result.residual[k].px.own_depth_px;
    if (voter[k] && points[k].depth_m > 0 && own_px >= 0) of_voters_px.push_back(own_px);
  }
  if (of_voters_px.empty()) return result;
  const auto middle = of_voters_px.begin() + static_cast<std::ptrdiff_t>(of_voters_px.size() / 2);
  std::nth_element(of_voters_px.begin(), middle, of_voters_px.end());
  result.limit_px = std::clamp(config_.limit_medians * *middle, config_.limit_px,
                               kMostAnchorLimits * config_.limit_px);
  return result;
}

AnchorResidual PointAnchors::judge_one(const Camera& camera, const Chain& chain,
                                       const RigidPoint& point, const SE3& T_current_odom) const {
  for (int a = 0; a < chain.size; ++a) {
    const Anchor& anchor = chain.anchors[a];
    const int age = newest_ + 1 - anchor.frame;
    if (age < config_.min_age_frames) break;
    const Pose* then = pose_of(anchor.frame);
    if (!then) continue;
    const RigidPoint seen{anchor.ideal_px.cast<double>(), point.current_px, anchor.depth_m,
                          anchor.range};
    return {rigid_residual(camera, T_current_odom * then->T_camera_odom.inverse(), seen), age};
  }
  return {};
}

void PointAnchors::push(std::span<const RigidPoint> points, std::span<const std::int32_t> link) {
  CHECK(points.size() == link.size());
  ++newest_;
  poses_.push_back({newest_, false, SE3()});
  while (static_cast<int>(poses_.size()) > kAnchors * config_.spacing_frames + 1)
    poses_.pop_front();
  std::vector<Chain> chains(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    Chain& chain = chains[i];
    if (link[i] >= 0 && link[i] < std::ssize(chains_)) chain = chains_[link[i]];
    const bool due =
        chain.size == 0 || newest_ - chain.anchors[chain.size - 1].frame >= config_.spacing_frames;
    if (!due) continue;
    if (chain.size == kAnchors) {
      std::move(chain.anchors.begin() + 1, chain.anchors.end(), chain.anchors.begin());
      --chain.size;
    }
    chain.anchors[chain.size++] = {newest_, points[i].previous_px.cast<float>(),
                                   static_cast<float>(points[i].depth_m), points[i].range};
  }
  chains_ = std::move(chains);
}

void PointAnchors::set_pose(const SE3& T_camera_odom) {
  if (!poses_.empty()) poses_.back() = {newest_, T_camera_odom.is_finite(), T_camera_odom};
}

const PointAnchors::Pose* PointAnchors::pose_of(std::int32_t frame) const {
  if (poses_.empty() || frame < poses_.front().frame || frame > newest_) return nullptr;
  const Pose& pose = poses_[static_cast<std::size_t>(frame - poses_.front().frame)];
  return pose.known ? &pose : nullptr;
}

void PointAnchors::clear() {
  chains_.clear();
  poses_.clear();
}

}  // namespace ygslam
