// A frame as the object tracker sees it, in the odometry frame, which never jumps.
#pragma once

#include <map>
#include <vector>

#include "core/ids.hpp"
#include "core/time.hpp"
#include "objects/instance_view.hpp"

namespace ygslam {

/// What is known about one feature of the current frame.
struct ObjectPoint {
  Eigen::Vector2f uv_px = Eigen::Vector2f::Zero();
  float depth_m = 0;           ///< 0 = none
  Vec3 p_odom = Vec3::Zero();  ///< meaningful with depth
  std::int32_t previous = -1;  ///< point of the previous step that it surely continues, -1 = none
  bool moves = false;          ///< breaks the camera's motion
  bool stands = false;         ///< was judged and obeys it
};
using PointIndices = std::vector<std::uint32_t>;

struct ObjectInput {
  FrameId frame = kNoFrame;
  Timestamp stamp;
  SE3 T_camera_odom;
  SE3 T_world_odom;
  std::vector<ObjectPoint> points;     ///< one per feature
  Thumbnail thumbnail;                 ///< of this frame
  std::vector<SegmentationPtr> masks;  ///< that came since the last step, of this or earlier frames
};

/// Where a track is in one frame.
struct TrackPlace {
  PixelBox box;  ///< may reach beyond the image
  Vec3 centre_odom = Vec3::Zero();
};

/// Kept until the frame's mask has come.
struct ObjectFrame {
  ObjectInput in;
  std::vector<int> track_of;        ///< per point the key of its track, -1 = none
  std::map<int, TrackPlace> place;  ///< of every track known then, by key

  [[nodiscard]] double depth_m(const Vec3& p_odom) const { return (in.T_camera_odom * p_odom).z(); }
  [[nodiscard]] double seconds_since(Timestamp earlier) const {
    return seconds_between(in.stamp, earlier);
  }
};

}  // namespace ygslam
