#include "system/pose_drift.hpp"

#include <algorithm>
#include <iterator>
#include <unordered_set>
#include <utility>

#include "system/pose_covariance.hpp"

namespace ygslam {
namespace {

/// Times a variance.
struct Growth {
  double position, rotation;
};

// How well frames see their ground tells how well new ground is mapped: the same metre drifts more
// in a bare corridor than in a furnished room. In variances of a frame's pose against its points.
// Learned from rendered worlds with people and from a robot's drive, checked on other seeds
// (bench/nees.py). New ground, from keyframe to keyframe:
constexpr Growth kForEachMetre{4, 6.5};
constexpr Growth kForEachRadian{2.4, 5.2};
// Odom does not go along when the map's newest part is adjusted.
constexpr Doubt kOdomShare{2, 4};
constexpr Growth kOdomForEachMetre{0.4, 0.5};  // on any ground
constexpr double kMeanOver_s = 1.5;            // of how well frames see their ground
constexpr std::size_t kMostGrounds = 8192;
constexpr std::ptrdiff_t kFewestShared = 15;          // landmarks, of keyframes that show the same
constexpr double kHand_mps = 0.5, kHand_radps = 0.5;  // of a camera that is lost
constexpr Doubt kOtherRoom{0.5 * 0.5, 0.2 * 0.2};     // a place that is not certain yet

Doubt operator+(const Doubt& a, const Doubt& b) {
  return {a.position_m2 + b.position_m2, a.rotation_rad2 + b.rotation_rad2};
}

Doubt operator*(double factor, const Doubt& doubt) {
  return {factor * doubt.position_m2, factor * doubt.rotation_rad2};
}

Doubt operator*(const Growth& growth, const Doubt& doubt) {
  return {growth.position * doubt.position_m2, growth.rotation * doubt.rotation_rad2};
}

Doubt mean_of_axes(const Mat6& covariance) {
  return {covariance.topLeftCorner<3, 3>().trace() / 3,
          covariance.bottomRightCorner<3, 3>().trace() / 3};
}

/// The newest keyframes are in view whatever they see.
bool show_the_same(const ViewKeyframe& a, const ViewKeyframe& b) {
  const std::unordered_set<std::int32_t> of_a(a.landmarks.begin(), a.landmarks.end());
  return std::ranges::count_if(b.landmarks, [&](std::int32_t landmark) {
           return landmark >= 0 && of_a.contains(landmark);
         }) >= kFewestShared;
}

}  // namespace

/// Of new ground so far from that by which it was mapped.
Doubt PoseDrift::way_over(const SE3& T) const {
  return T.t().norm() * (kForEachMetre * seen_) + T.angle() * (kForEachRadian * seen_);
}

void PoseDrift::see(Timestamp stamp, const TrackResult& result) {
  if (!result.covariance) return;
  const Doubt now = mean_of_axes(seen_covariance(result));
  const double passed_s = last_seen_ ? seconds_between(stamp, *last_seen_) : kMeanOver_s;
  const double share = seen_.position_m2 > 0 ? std::min(1.0, passed_s / kMeanOver_s) : 1;
  seen_ = (1 - share) * seen_ + share * now;
}

/// An old keyframe that nobody was told by yet is like its neighbour.
Doubt PoseDrift::ground_of(KeyframeId reference, const LocalView& view) {
  if (reference == kNoKeyframe) return ground_;  // nothing is mapped yet
  const auto known = grounds_.find(reference);
  if (known != grounds_.end()) return known->second;
  const auto after = grounds_.upper_bound(reference);
  const Doubt ground = after == grounds_.end()     ? mapped_ground(reference, view)
                       : after == grounds_.begin() ? after->second
                                                   : std::prev(after)->second;
  grounds_.emplace(reference, ground);
  forget_some();
  return ground;
}

/// Forgets every second keyframe; ground_of() takes its neighbour's ground.
void PoseDrift::forget_some() {
  if (grounds_.size() <= kMostGrounds) return;
  for (auto at = grounds_.begin(); at != grounds_.end() && std::next(at) != grounds_.end();)
    at = grounds_.erase(std::next(at));
}

/// Of the newest keyframe: told by the best of those that show the same, else by the last frame.
Doubt PoseDrift::mapped_ground(KeyframeId keyframe, const LocalView& view) {
  Doubt from = ground_ + coasted_there_, more = way_over(pose_.T_camera_reference);
  bool is_told = false;
  const auto newest = std::ranges::find_if(
      view.keyframes, [&](const ViewKeyframe& k) { return k.data->id == keyframe; });
  for (const ViewKeyframe& other : view.keyframes) {
    const auto known = grounds_.find(other.data->id);
    if (newest == view.keyframes.end() || known == grounds_.end()) continue;
    if (!show_the_same(*newest, other)) continue;
    const Doubt way = way_over(newest->T_camera_world * other.T_camera_world.inverse());
    const bool is_better = (known->second + way).position_m2 < (from + more).position_m2;
    if (std::exchange(is_told, true) && !is_better) continue;
    from = known->second;
    more = way;
  }
  const Doubt ground = from + more, last = ground_ + std::exchange(coasted_there_, {});
  // Beyond that of the last frame, odom drifts, too.
  odom_.position_m2 +=
      kOdomShare.position_m2 * std::max(0.0, ground.position_m2 - last.position_m2);
  odom_.rotation_rad2 +=
      kOdomShare.rotation_rad2 * std::max(0.0, ground.rotation_rad2 - last.rotation_rad2);
  return ground;
}

/// What happened while nothing was seen.
void PoseDrift::come_back(Timestamp stamp) {
  if (!last_seen_ || was_lost_) by_view_ = true;
  if (std::exchange(was_lost_, false) && last_seen_) {
    const double gap_s = seconds_between(stamp, *last_seen_);
    coasted_there_ = {};
    odom_ = odom_ + gap_s * gap_s * Doubt{kHand_mps * kHand_mps, kHand_radps * kHand_radps};
  } else if (coasted_) {
    const Doubt coasted = mean_of_axes(*coasted_);
    coasted_there_ = coasted_there_ + coasted;
    odom_ = odom_ + coasted;
  }
  coasted_.reset();
}

Doubt PoseDrift::in_map() const {
  return ground_ + coasted_there_ + (by_view_ ? kOtherRoom : Doubt{});
}

PoseDoubt PoseDrift::step(Timestamp stamp, const TrackResult& result, const LocalView& view) {
  if (result.state == TrackState::kLost) was_lost_ = true;
  if (result.state == TrackState::kCoasting) coasted_ = result.covariance;
  if (!is_seen(result.state)) return {odom_, in_map()};
  const bool is_first = result.matches == 0;  // the origin, or of a submap
  if (!is_first) {
    see(stamp, result);
    come_back(stamp);
    if (!result.provisional) coasted_there_ = {};  // it sees what it knows
    ground_ = ground_of(result.pose.reference, view);
    const double way_m = (result.T_odom_camera.t() - T_odom_camera_.t()).norm();
    odom_ = odom_ + way_m * (kOdomForEachMetre * seen_);
  }
  by_view_ = by_view_ && result.provisional;
  last_seen_ = stamp;
  pose_ = result.pose;
  T_odom_camera_ = result.T_odom_camera;
  return {odom_, in_map()};
}

}  // namespace ygslam
