// How far the pose of a frame is to be believed: tracking, weak or lost.
#pragma once

#include <cstdint>
#include <optional>

#include "tracking/inertial_verdict.hpp"
#include "tracking/pose_estimator.hpp"

namespace ygslam {

enum class TrackState : std::uint8_t {
  kWaiting,  ///< no frame with enough depth yet
  kTracking,
  kWeak,  ///< a pose, but few points agree on it or they leave it uncertain
  kLost,
  kCoasting,  ///< nothing is seen that tells a pose: an IMU or wheels do, for some seconds
};
/// A weak pose is so many times less certain than its covariance says: its few points may agree by
/// chance, which the noise model knows nothing of.
inline constexpr double kWeakStdFactor = 3;
[[nodiscard]] const char* to_string(TrackState state);
[[nodiscard]] inline bool is_seen(TrackState state) {
  return state == TrackState::kTracking || state == TrackState::kWeak;
}
[[nodiscard]] inline bool has_pose(TrackState state) {
  return is_seen(state) || state == TrackState::kCoasting;
}

struct TrackJudgeConfig {
  int min_inliers = 30;               ///< below: weak; below half of it: lost
  int weak_frames_until_lost = 10;    ///< in a row
  double weak_position_std_m = 0.03;  ///< the camera centre less certain than this: weak
  double lost_position_std_m = 0.1;   ///< ... than this: lost
  /// A weak pose farther than this from the prediction (or than this speed would carry it over a
  /// longer gap), or after a loss from the last known place, rests on wrong matches.
  double max_jump_m = 0.08;
  double max_jump_mps = 1.0;

  /// Fewer inliers: lost.
  [[nodiscard]] int least_inliers() const { return min_inliers / 2; }
};

/// How far the camera centre of a pose lies from where it might be expected.
struct PoseJump {
  double from_prediction_m = 0;  ///< 0 for a pose that no prediction led to
  double from_last_m = 0;        ///< from that of the last frame with a pose ...
  double gap_s = 0;              ///< ... so long ago
};

class TrackJudge {
 public:
  explicit TrackJudge(const TrackJudgeConfig& config) : config_(config) {}

  [[nodiscard]] TrackState state() const { return state_; }
  /// The last frame had a pose that IMU or wheels contradict: they lead the camera instead.
  [[nodiscard]] bool has_overruled() const { return overruled_; }
  /// What contradicts it is the prediction of half a second ago alone: the newer one went along.
  [[nodiscard]] bool went_along() const { return went_along_; }
  /// The run's first frame: its place is what all others are told by.
  void start() { state_ = TrackState::kTracking; }
  /// A frame after that. @param pose nullopt: none was found.
  TrackState next_state(const std::optional<PoseResult>& pose, const PoseJump& jump,
                        const InertialVerdict& inertial = {});
  /// The first frame of a run in a map. @return true if what was found there is believed.
  bool start_in_map(const std::optional<PoseResult>& pose);
  /// A run that has not started begins in a place of its own.
  void lose() { state_ = TrackState::kLost; }

 private:
  [[nodiscard]] bool is_pose(const std::optional<PoseResult>& pose) const;
  [[nodiscard]] TrackState judge(const std::optional<PoseResult>& pose, const PoseJump& jump,
                                 bool expected);
  void overrule(TrackState by_vision, const InertialVerdict& inertial);
  [[nodiscard]] bool is_proof(const PoseResult& pose) const;

  TrackJudgeConfig config_;
  TrackState state_ = TrackState::kWaiting;
  bool overruled_ = false, went_along_ = false;  // in the last frame
  bool led_along_ = false;                       // it coasts since one was
  int weak_frames_ = 0;
  int frames_since_loss_ = 1 << 20;
};

}  // namespace ygslam
