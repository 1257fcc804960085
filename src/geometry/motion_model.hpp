// Constant velocity between frames.
#pragma once

#include <optional>

#include "core/time.hpp"
#include "geometry/se3.hpp"

namespace ygslam {

struct MotionModelConfig {
  double max_gap_s = 0.25;  ///< over a longer gap the velocity says nothing: predict standstill
};

/// How the camera is expected to have moved since the last update.
struct PredictedMotion {
  SE3 T_now_last;                     ///< identity without a usable velocity
  Vec6 body_velocity = Vec6::Zero();  ///< MotionModel::body_velocity() of T_now_last
  double velocity_gain_per_s =
      0;  ///< minus its derivative by the logarithm of T_now_last, the same for all
};

class MotionModel {
 public:
  explicit MotionModel(const MotionModelConfig& config) : config_(config) {}

  [[nodiscard]] PredictedMotion predict(Timestamp now) const;
  /// The camera's velocity at `now`, if it moved by T_now_last since the last update: twist per
  /// second in its own frame, T_world_camera(now + t) = T_world_camera(now) exp(t velocity).
  /// Extrapolated from this step and the one before. Zero over too long a gap.
  [[nodiscard]] Vec6 body_velocity(Timestamp now, const SE3& T_now_last) const;
  /// @param T_now_last measured motion since the last update.
  void update(Timestamp now, const SE3& T_now_last);
  /// Forgets the velocity, e.g. after a loss; the next update starts at `now`.
  void reset(Timestamp now);

 private:
  [[nodiscard]] double velocity_gain_per_s(Timestamp now) const;

  MotionModelConfig config_;
  Timestamp last_;
  double last_step_s_ = 0;
  std::optional<Vec6> velocity_per_s_;  // twist of T_now_last
};

}  // namespace ygslam
