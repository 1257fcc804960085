// Pixels of the camera that show nothing of the world: what is fixed to the camera (an ego mask),
// or what the user does not want to be looked at.
#pragma once

#include <memory>
#include <string>

#include "image/rgbd_frame.hpp"

namespace ygslam {

/// Of the colour image's size: 255 = not of the world, 0 = all others. Never changes once made;
/// null = nothing is masked.
using PixelMaskPtr = std::shared_ptr<const GreyImage>;

/// What either covers. Both of one size.
[[nodiscard]] PixelMaskPtr joined(const PixelMaskPtr& a, const PixelMaskPtr& b);

/// Whether `now` covers pixels that `before` did not.
[[nodiscard]] bool covers_more(const PixelMaskPtr& now, const PixelMaskPtr& before);

/// Share of the image in [0, 1].
[[nodiscard]] double covered_share(const PixelMaskPtr& mask);

/// Where in the image most of it lies: "lower edge", "upper left", "centre", or "all over".
[[nodiscard]] std::string place_in_image(const GreyImage& mask);

/// The frame with no depth where it is masked: itself where nothing is, or the size is another.
[[nodiscard]] FramePtr without_masked_depth(const FramePtr& frame, const PixelMaskPtr& mask);

}  // namespace ygslam
