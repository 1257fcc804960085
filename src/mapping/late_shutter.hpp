// A read-out time that is found when part of the map is made already.
#pragma once

#include "geometry/camera.hpp"
#include "map/map.hpp"

namespace ygslam {

/// Brings the features of the keyframes that were taken as read in `was_s` to their middle instants
/// again, with the read-out time of colour and depth as it is known now, and moves landmarks along.
/// What poses and points make of it is for an adjustment of the whole map.
/// @return false if there is no such keyframe.
bool correct_shutter(Map& map, const Camera& camera, double was_s, double now_s);

}  // namespace ygslam
