#include "tracking/track_judge.hpp"

#include <algorithm>

#include "core/chi_square.hpp"

namespace ygslam {
namespace {

constexpr int kProvingFrames = 10;       // after a loss ...
constexpr double kProvingFactor = 1.67;  // ... a pose needs so many times the usual inliers
// NIS beyond which a prediction overrules a pose: of a weak one 99.9 % of chi-square with 6 degrees
// of freedom, of others that at twice the standard deviation. Poses that are right stay below 5
// (docs/inertial.md).
constexpr double kMostWeakNis = kMostChiSquare6, kMostNis = 4 * kMostWeakNis;

}  // namespace

const char* to_string(TrackState state) {
  switch (state) {
    case TrackState::kWaiting:
      return "waiting";
    case TrackState::kTracking:
      return "tracking";
    case TrackState::kWeak:
      return "weak";
    case TrackState::kLost:
      return "lost";
    case TrackState::kCoasting:
      return "coasting";
  }
  return "?";
}

TrackState TrackJudge::next_state(const std::optional<PoseResult>& pose, const PoseJump& jump,
                                  const InertialVerdict& inertial) {
  const TrackState by_vision = judge(pose, jump, inertial.agrees);
  // On a white wall a few points by chance say less than what has led the camera so far.
  const double factor = by_vision == TrackState::kWeak ? kWeakStdFactor : 1;
  const bool knows_less = state_ == TrackState::kCoasting && by_vision != TrackState::kLost &&
                          factor * pose->position_std_m > inertial.position_std_m;
  overrule(by_vision, inertial);
  const bool coasts =
      inertial.may_coast && (by_vision == TrackState::kLost || knows_less || overruled_);
  if (coasts) weak_frames_ = 0;
  led_along_ = coasts && (led_along_ || overruled_);
  state_ = coasts ? TrackState::kCoasting : by_vision;
  return state_;
}

/// A pose that ends a loss is the map's, and knows better than what has led the camera since.
void TrackJudge::overrule(TrackState by_vision, const InertialVerdict& inertial) {
  const double limit = by_vision == TrackState::kWeak ? kMostWeakNis : kMostNis;
  const bool may_overrule =
      inertial.may_coast && is_seen(by_vision) && (is_seen(state_) || led_along_);
  const bool by_newest = inertial.nis > limit;
  overruled_ = may_overrule && (by_newest || inertial.earlier_nis > limit);
  went_along_ = overruled_ && !by_newest;
}

bool TrackJudge::start_in_map(const std::optional<PoseResult>& pose) {
  if (!pose || !is_proof(*pose)) return false;
  state_ = TrackState::kTracking;
  frames_since_loss_ = 0;
  return true;
}

bool TrackJudge::is_pose(const std::optional<PoseResult>& pose) const {
  return pose && pose->inliers >= config_.least_inliers() && pose->T_camera_world.is_finite() &&
         pose->position_std_m <= config_.lost_position_std_m;
}

bool TrackJudge::is_proof(const PoseResult& pose) const {
  return pose.inliers >= kProvingFactor * config_.min_inliers;
}

/// @param expected an IMU or wheels have predicted the pose.
TrackState TrackJudge::judge(const std::optional<PoseResult>& pose, const PoseJump& jump,
                             bool expected) {
  if (!is_pose(pose)) return TrackState::kLost;
  const bool was_lost =
      state_ == TrackState::kLost || (state_ == TrackState::kCoasting && !expected);
  // A place found again must prove itself for a while: few points fit many places.
  frames_since_loss_ = was_lost ? 0 : frames_since_loss_ + 1;
  if (frames_since_loss_ < kProvingFrames && !is_proof(*pose)) return TrackState::kLost;
  const bool many = pose->inliers >= config_.min_inliers;
  const bool certain = pose->position_std_m <= config_.weak_position_std_m && !pose->contested;
  if (many && certain) {
    weak_frames_ = 0;
    return TrackState::kTracking;
  }
  // After a loss only the last known place vouches for a weak pose.
  const double jump_m = was_lost ? jump.from_last_m : jump.from_prediction_m;
  const double reach_m = was_lost ? 0 : jump.gap_s * config_.max_jump_mps;
  if (!expected && jump_m > std::max(config_.max_jump_m, reach_m)) return TrackState::kLost;
  if (many) return TrackState::kWeak;  // uncertain by its weights, but no chance matches
  return ++weak_frames_ > config_.weak_frames_until_lost ? TrackState::kLost : TrackState::kWeak;
}

}  // namespace ygslam
