// A read-out time that is found when part of the map is made already.
#pragma once

#include "geometry/camera.hpp"
#include "map/map.hpp"

namespace ygslam {

/// Brings the features of the keyframes that were taken as read in `was_s` to their middle instants
/// again, with the times as they are known now, and moves landmarks along.
/// @param was_s of the colour image.
/// What poses and points make of it is for an adjustment of the whole map.
/// @return false if there is no such keyframe.
bool correct_shutter(Map& map, const Camera& camera, double was_s, const ShutterTimes& now);

}  // namespace ygslam
