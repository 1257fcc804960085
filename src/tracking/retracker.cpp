#include "tracking/retracker.hpp"

#include <cmath>
#include <utility>

#include "tracking/view_poses.hpp"

namespace ygslam {
namespace {

constexpr double kKept_s = 2.0;
constexpr std::size_t kMostKept = 120;
constexpr int kWait = 10;           // frames until the map has surely been told
constexpr int kAtOnce = 2;          // frames, so that no frame takes long
constexpr double kWorth = 0.005;    // share of the image: less misleads nobody
constexpr double kFewStatic = 0.3;  // share of the points that is too small to be believed

FramePtr without_images(const RgbdFrame& frame) {
  auto small = std::make_shared<RgbdFrame>();
  small->id = frame.id;
  small->stamp = frame.stamp;
  return small;
}

/// Labels of a frame that was misled are wrong, too: where hardly anything is static, all is taken
/// for it.
void leave_out(const GreyImage& mask, TrackedFrame& frame) {
  std::vector<float>& weight = frame.seen.static_weight;
  std::vector<std::uint8_t> is_masked(weight.size());
  double seen = 0, is_static = 0;
  for (std::size_t i = 0; i < weight.size(); ++i) {
    const Eigen::Vector2f& px = frame.seen.features->points[i].uv_px;
    const int u = static_cast<int>(std::lround(px.x())), v = static_cast<int>(std::lround(px.y()));
    is_masked[i] = mask.contains(u, v) && mask.at(u, v) != 0 ? 1 : 0;
    if (is_masked[i] != 0) continue;
    ++seen;
    if (weight[i] > 0) ++is_static;
  }
  for (std::size_t i = 0; i < weight.size(); ++i) {
    if (is_static < kFewStatic * seen) weight[i] = 1;
    if (is_masked[i] != 0) weight[i] = 0;
  }
}

}  // namespace

void Retracker::add(const TrackedFrame& frame, const PixelMaskPtr& mask) {
  frames_.push_back(frame);
  TrackedFrame& kept = frames_.back();
  kept.seen.frame = without_images(*frame.seen.frame);
  kept.seen.grid = {};  // made anew for those that are gone over
  kept.view.reset();
  const auto is_old = [&](const TrackedFrame& f) {
    return seconds_between(frame.seen.frame->stamp, f.seen.frame->stamp) > kKept_s;
  };
  while (frames_.size() > kMostKept || is_old(frames_.front())) frames_.pop_front();
  const double share = covered_share(mask);
  if (share < done_share_ + kWorth) return;
  done_share_ = share;
  mask_ = mask;
  wait_ = kWait;
  later_.reset();
}

std::vector<RetrackedFrame> Retracker::step(const LocalView& view, bool is_sure, Rng& rng) {
  std::vector<RetrackedFrame> found;
  if (!mask_ || !is_sure || view.empty()) return found;
  if (!later_) {
    if (--wait_ > 0) return found;
    begin();
  }
  for (int i = 0; i < kAtOnce && later_; ++i)
    if (auto moved = go_back(view, rng)) found.push_back(std::move(*moved));
  return found;
}

/// From the newest frame.
void Retracker::begin() {
  earlier_ = frames_;
  if (earlier_.empty()) return mask_.reset();
  later_ = {std::move(earlier_.back()), SE3()};
  leave_out(*mask_, later_->frame);
  earlier_.pop_back();
}

std::optional<RetrackedFrame> Retracker::go_back(const LocalView& view, Rng& rng) {
  const auto T_later_world = pose_in(view, later_->frame.pose);
  std::optional<PoseResult> pose;
  if (T_later_world && !earlier_.empty()) {
    leave_out(*mask_, earlier_.back());
    FrameFeatures& seen = earlier_.back().seen;
    seen.grid = FeatureGrid(*seen.features, estimator_.camera().ideal_bounds());
    if (const auto first = estimator_.match_previous_frame(
            seen, later_->frame, *T_later_world, view, later_->T_now_before * *T_later_world, rng))
      pose = estimator_.match_map(seen, view, *first);
  }
  if (!pose || pose->inliers < least_inliers_) {
    later_.reset();
    mask_.reset();
    return std::nullopt;
  }
  TrackedFrame frame = std::move(earlier_.back());
  earlier_.pop_back();
  frame.landmarks = pose->landmarks;
  frame.pose = relative_to_keyframe(pose->T_camera_world, view);
  const RetrackedFrame found{frame.seen.frame->id, frame.pose};
  later_ = {std::move(frame), pose->T_camera_world * T_later_world->inverse()};
  return found;
}

}  // namespace ygslam
