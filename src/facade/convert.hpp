// Values of the system as the library hands them out.
#pragma once

#include <span>

#include "image/coloured_point.hpp"
#include "tracking/track_result.hpp"
#include "ygslam/slam.hpp"

namespace ygslam::api {

[[nodiscard]] inline std::array<double, 3> to_api(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
[[nodiscard]] Pose to_api(const SE3& T);
[[nodiscard]] std::vector<MapPoint> to_api(std::span<const ColouredPoint> points);
/// All that the frame's result says of the frame itself.
[[nodiscard]] Result to_api(const TrackResult& tracked);

[[nodiscard]] bool is_finite(const std::array<double, 3>& v);
[[nodiscard]] bool is_pose(const Pose& pose);
/// No farther along any axis.
[[nodiscard]] bool is_within(const Pose& pose, double most_m);
/// @throws Error (4) naming it, where numbers are not finite or the quaternion is none.
[[nodiscard]] SE3 to_se3(const Pose& pose, const char* name);

}  // namespace ygslam::api
