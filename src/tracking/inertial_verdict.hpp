// What a prediction by IMU or wheels means for a frame's pose.
#pragma once

#include <optional>

#include "image/rgbd_frame.hpp"
#include "inertial/pose_prediction.hpp"
#include "map/messages.hpp"

namespace ygslam {

struct InertialVerdict {
  bool may_coast = false;     ///< the prediction may stand for a pose
  bool agrees = false;        ///< the pose that was found lies where it was predicted
  double position_std_m = 0;  ///< of the prediction
  /// Normalised innovation squared (NIS, 6 degrees of freedom) of the pose against the newest
  /// prediction and that of half a second ago; 0 where the prediction must not overrule.
  double nis = 0, earlier_nis = 0;
};

/// Of all three axes together.
[[nodiscard]] double position_std_m(const PosePrediction& inertial);

/// The prediction, unless vision was away for so long that it says little.
[[nodiscard]] std::optional<PosePrediction> while_certain(
    const std::optional<PosePrediction>& inertial);

/// A pose that was found. @param covariance as TrackResult's.
struct SeenCamera {
  SE3 T_camera_world;
  Mat6 covariance = Mat6::Zero();
};
/// @param inertial by while_certain(). @param seen if a pose was found.
/// @param T_guess_world as predicted.
[[nodiscard]] InertialVerdict verdict_of(const std::optional<PosePrediction>& inertial,
                                         const std::optional<SeenCamera>& seen,
                                         const SE3& T_guess_world);

/// A camera that hangs repeats its image while it is moved. (At rest those of a rendered camera
/// without noise are alike, too.) @param T_now_last as predicted.
[[nodiscard]] bool camera_hangs(const RgbdFrame& now, const RgbdFrame& last, const SE3& T_now_last);

/// With all that vision said in the last half second left out.
[[nodiscard]] PosePrediction without_newest(PosePrediction inertial);

/// Of a keyframe here. @param T_now_last, last the motion since the last frame with a pose, and it.
[[nodiscard]] KeyframeMotion motion_by(const PosePrediction& inertial, const SE3& T_now_last,
                                       const KeyframeRelativePose& last);

}  // namespace ygslam
