// Poses between frames, keyframes and what the tracker sees of the map.
#pragma once

#include <optional>

#include "map/local_view.hpp"
#include "map/messages.hpp"
#include "tracking/pose_estimator.hpp"
#include "tracking/tracked_frame.hpp"

namespace ygslam {

/// The pose relative to the view's reference; before the first view to the run's first keyframe,
/// which is the world then.
[[nodiscard]] KeyframeRelativePose relative_to_keyframe(const SE3& T_camera_world,
                                                        const LocalView& view);

/// T_camera_world, or nullopt where the view does not know the pose's keyframe.
[[nodiscard]] std::optional<SE3> pose_in(const LocalView& view, const KeyframeRelativePose& pose);

/// The keyframe that shares most of the frame's landmarks, if that is clearly another than the
/// reference: the camera has left the place the view was made for.
[[nodiscard]] std::optional<KeyframeId> better_reference(const TrackedFrame& frame,
                                                         const LocalView& view);

/// The keyframe that looked most as the camera does from there, if that is another than the
/// reference.
[[nodiscard]] std::optional<KeyframeId> nearest_reference(const SE3& T_camera_world,
                                                          const LocalView& view);

/// A frame as the tracker keeps it, found in this view.
[[nodiscard]] TrackedFrame with_pose(FrameFeatures seen, const PoseResult& pose,
                                     const LocalViewPtr& view, const SE3& T_odom_camera);
/// The same where it agreed with nothing in the map.
[[nodiscard]] TrackedFrame without_landmarks(FrameFeatures seen, const KeyframeRelativePose& pose,
                                             const LocalViewPtr& view, const SE3& T_odom_camera);

/// Of the camera centres.
[[nodiscard]] double centre_distance_m(const SE3& T_a_world, const SE3& T_b_world);

}  // namespace ygslam
