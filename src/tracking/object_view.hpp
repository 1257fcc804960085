// What the objects are told of a frame.
#pragma once

#include "geometry/camera.hpp"
#include "image/pixel_mask.hpp"
#include "objects/association.hpp"
#include "tracking/observed_frame.hpp"

namespace ygslam {

/// Where the camera of a frame is.
struct CameraPlace {
  SE3 T_odom_camera, T_world_odom;
};

/// @param now with its final labels, of a classifier that follows motion or masks.
/// @param own pixels that are not of the world.
[[nodiscard]] ObjectInput object_input(const ObservedFrame& now, const PointClassifier& classifier,
                                       const Camera& camera, const CameraPlace& place,
                                       const PixelMaskPtr& own);

}  // namespace ygslam
