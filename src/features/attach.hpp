// Gives image features their place in space.
#pragma once

#include "features/feature.hpp"
#include "features/pyramid_scales.hpp"
#include "geometry/rolling_shutter.hpp"
#include "image/image.hpp"

namespace ygslam {

/// Sets ideal_px (lens distortion removed), depth_m (0 = none), depth_slope and on_depth_edge of
/// every feature from its uv_px.
/// @param depth_m registered to the image of the features; empty = no depth at all.
/// @param scales of the levels the features were found in.
void attach_geometry(Features& features, const Camera& camera, const DepthImage& depth_m,
                     const PyramidScales& scales);

/// Moves ideal_px and depth_m, from uv_px again, to where the camera would have seen the features
/// had it seen all of them at the frame's middle instant. Without depth only the camera's rotation
/// is taken into account, without a velocity nothing. A global shutter's features stay as they are.
void move_to_middle_instant(Features& features, const Camera& camera, const DepthImage& depth_m,
                            const ReadOut& read_out);

/// Moves features that are at the middle instant as `was` had it to where `now` has it, without the
/// depth image: depths are not read again, so only the time of their own pixel counts.
void move_to_other_times(Features& features, const Camera& camera, const ReadOut& was,
                         const ReadOut& now);

}  // namespace ygslam
