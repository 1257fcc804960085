// How strong a corner is, and where it lies between the pixels.
#pragma once

#include <cstdint>

#include <Eigen/Core>

namespace ygslam {

/// Harris & Stephens' measure det(A) - 0.04 tr(A)^2 of the structure tensor A, summed over 5x5
/// Sobel gradients (reads 7x7 pixels). At least 0.
[[nodiscard]] float harris_strength(const std::uint8_t* pixel, int stride);

/// Offset [px] from a pixel whose FAST score is largest in its 3x3 neighbourhood to the summit of
/// the quadratic surface through the scores around it; zero where the surface has no summit within
/// 0.75 px. The score falls off steeply on all sides of a corner, which makes this twice as exact
/// as the pixel and far better than the tensor's least-squares corner (Foerstner & Guelch 1987),
/// which other edges nearby pull away. Reads up to 32 columns to the right.
[[nodiscard]] Eigen::Vector2f corner_offset_px(const std::uint8_t* pixel, int stride);

}  // namespace ygslam
