// What a run shows of itself, as ROS 2 messages. Frames as REP 105 has them: map -> odom -> camera,
// axes as REP 103 has them (x forward, y left, z up, as level as the first camera was held), and
// camera -> camera_optical with the axes of the image.
#pragma once

#include <span>
#include <string>

#include "bag/ros_messages.hpp"
#include "image/coloured_point.hpp"
#include "loop/loop_closer.hpp"
#include "map/map.hpp"
#include "scene/scene.hpp"
#include "system/pose_covariance.hpp"
#include "tracking/tracker.hpp"

namespace ygslam {

inline constexpr const char* kCameraFrame = "camera_optical";

/// Axes of REP 103 of a frame whose axes are those of an image (x right, y down, z forward).
[[nodiscard]] const SE3& T_body_optical();

/// A pose whose frames have the axes of an image, between frames with those of REP 103.
[[nodiscard]] ros::Pose pose_in_map(const SE3& T_parent_child);

/// map -> odom (while the camera is tracked), odom -> camera, camera -> camera_optical.
[[nodiscard]] ros::TfMessage tf_message(const RgbdFrame& frame, const TrackResult& result);
/// The camera in odom, with the pose's covariance (odom_covariance()) in the axes of odom as
/// nav_msgs has it; velocities are not known.
[[nodiscard]] ros::Odometry odometry_message(const RgbdFrame& frame, const TrackResult& result);
/// The colour image as a JPEG.
[[nodiscard]] ros::CompressedImage image_message(const RgbdFrame& frame);
/// @param frame of the images.
[[nodiscard]] ros::CameraInfo camera_info_message(const CameraConfig& camera, Timestamp stamp,
                                                  const char* frame = kCameraFrame);
/// Static points green, dynamic red, unknown yellow; boxes and names of objects; the outline of
/// the newest mask that came with the frame (a list of lines), with the stamp of its own image.
[[nodiscard]] ros::ImageAnnotations annotation_message(const RgbdFrame& frame,
                                                       const TrackResult& result);
/// Boxes, names and velocities of what moves or could; older ones are erased.
[[nodiscard]] ros::MarkerArray object_message(const RgbdFrame& frame, const TrackResult& result);
/// State in words, counts and times.
[[nodiscard]] ros::DiagnosticArray state_message(const RgbdFrame& frame, const TrackResult& result);
[[nodiscard]] ros::PointCloud2 landmark_message(const Map& map, Timestamp stamp);
/// map -> floor: z is up, as level as the floor that was found.
[[nodiscard]] ros::TfMessage floor_message(const Gravity& gravity, Timestamp stamp);
/// At most most_points of the points, evenly spread.
[[nodiscard]] ros::PointCloud2 cloud_message(std::span<const ColouredPoint> points,
                                             std::size_t most_points, Timestamp stamp);
/// A line between the two keyframes of each loop that is closed.
[[nodiscard]] ros::MarkerArray loop_message(const Map& map, std::span<const LoopAttempt> attempts,
                                            Timestamp stamp);
/// The keyframes' poses.
[[nodiscard]] ros::Path path_message(const Map& map, Timestamp stamp);

}  // namespace ygslam
