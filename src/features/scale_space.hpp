// The scales of an image in which features are found.
#pragma once

#include "image/padded_image.hpp"

namespace ygslam {

/// Border of the levels: for the patches of corners at the edge and for vector loads.
inline constexpr int kLevelBorder_px = 32;

/// Bilinear reduction: pixel (u, v) of `target` lies at (ratio u, ratio v) of `source`, so that a
/// level's pixel times its scale is the pixel of the full image, without any offset.
/// @param ratio in [1, 2]. `target` gets the size of all samples inside `source` and its border.
void reduce(const PaddedImage& source, double ratio, int width, int height, PaddedImage& target);

/// Gaussian blur, 7x7, sigma 2 px, weights in 1/256 (the smoothing of Rublee et al. 2011 before the
/// binary tests). Also fills 8 px beyond the image.
void blur_7x7(const PaddedImage& source, PaddedImage& target);

}  // namespace ygslam
