// What a user should know of a recording before it is worked on.
#pragma once

#include "image/rgbd_frame.hpp"
#include "io/sequence.hpp"

namespace ygslam {

/// Warns where a frame's depth is none of a room, or lies turned over on its colour image.
void warn_about_depth(const RgbdFrame& frame);
/// Warns where an image has too few pixels for good poses.
void warn_about_size(const Sequence& sequence);
/// Logs when its rows are read, as far as that is known.
void log_shutter(const Sequence& sequence);
/// Logs the camera of the depth images where it is another.
void log_registration(const Sequence& sequence);

}  // namespace ygslam
