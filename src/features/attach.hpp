// Gives image features their place in space.
#pragma once

#include "features/feature.hpp"
#include "features/pyramid_scales.hpp"
#include "geometry/camera.hpp"
#include "image/image.hpp"

namespace ygslam {

/// Sets ideal_px (lens distortion removed), depth_m (0 = none) and on_depth_edge of every feature
/// from its uv_px.
/// @param depth_m registered to the image of the features; empty = no depth at all.
/// @param scales of the levels the features were found in.
void attach_geometry(Features& features, const Camera& camera, const DepthImage& depth_m,
                     const PyramidScales& scales);

}  // namespace ygslam
