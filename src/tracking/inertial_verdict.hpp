// What a prediction by IMU or wheels means for a frame's pose.
#pragma once

#include <optional>

#include "inertial/inertial_prediction.hpp"
#include "map/messages.hpp"

namespace ygslam {

struct InertialVerdict {
  bool may_coast = false;     ///< the prediction may stand for a pose
  bool agrees = false;        ///< the pose that was found lies where it was predicted
  double position_std_m = 0;  ///< of the prediction
};

/// Of all three axes together.
[[nodiscard]] double position_std_m(const InertialPrediction& inertial);

/// The prediction, unless vision was away for so long that it says little.
[[nodiscard]] std::optional<InertialPrediction> while_certain(
    const std::optional<InertialPrediction>& inertial);

/// @param inertial by while_certain(). @param T_camera_world the pose that was found, if one was.
/// @param T_guess_world as predicted.
[[nodiscard]] InertialVerdict verdict_of(const std::optional<InertialPrediction>& inertial,
                                         const std::optional<SE3>& T_camera_world,
                                         const SE3& T_guess_world);

/// Of a keyframe here. @param T_now_last, last the motion since the last frame with a pose, and it.
[[nodiscard]] KeyframeMotion motion_by(const InertialPrediction& inertial, const SE3& T_now_last,
                                       const KeyframeRelativePose& last);

}  // namespace ygslam
