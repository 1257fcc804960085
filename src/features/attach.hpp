// Gives image features their place in space.
#pragma once

#include "features/feature.hpp"
#include "geometry/camera.hpp"
#include "image/image.hpp"

namespace ygslam {

/// Sets ideal_px (lens distortion removed) and depth_m (0 = none) of every feature from its uv_px.
/// @param depth_m registered to the image of the features; empty = no depth at all.
void attach_geometry(Features& features, const Camera& camera, const DepthImage& depth_m);

}  // namespace ygslam
