// What one dense keyframe contributes to the volume, as the image of an ideal pinhole camera at the
// middle instant of the frame: no lens distortion, no rolling shutter.
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/camera.hpp"
#include "geometry/rolling_shutter.hpp"
#include "image/image.hpp"
#include "scene/scene.hpp"

namespace ygslam {

/// A pinhole camera without distortion; a pixel's centre has integer coordinates. [px]
struct Pinhole {
  double fx = 0, fy = 0, cx = 0, cy = 0;
  int width = 0, height = 0;
};

/// Of a pixel at the edge of a thing's mask, and what it votes for: nothing.
inline constexpr SceneObjectId kUnsureObject{0xfffe};

/// One dense keyframe. Depth is exact in its unit, so that a stored and reloaded view (lossless)
/// contributes the same bits.
struct DepthView {
  static constexpr double kUnit_m = 0.0002;  ///< of `depth`; reaches to 13.1 m
  static constexpr std::uint8_t kNothing = 0, kUnsure = 254, kExcluded = 255;
  [[nodiscard]] static constexpr bool is_object(std::uint8_t object) {
    return object != kNothing && object < kUnsure;
  }

  Pinhole camera;
  Image<std::uint16_t> depth;  ///< along the optical axis [kUnit_m], 0 = none
  ColourImage colour;          ///< where there is depth
  /// What the pixel shows: kNothing: static, no object; 1 to 253: objects[value - 1]; kUnsure:
  /// static, an object or what lies beside it; kExcluded: a mover, or too close to the edge of a
  /// mover's mask: carves space as far as it was seen, adds nothing.
  Image<std::uint8_t> object;
  std::vector<SceneObjectId> objects;
  /// Cells of space that it does not carve: what stands there came later.
  std::vector<Eigen::Vector3i> spared;
};

/// The images of a frame as recorded; all of one size.
struct RecordedImages {
  const DepthImage& depth_m;  ///< registered to the colour image
  const ColourImage& colour;
  const Image<SceneObjectId>& object;  ///< of each pixel of the colour image; empty = no objects
  const GreyImage& excluded;           ///< not 0: see DepthView::kExcluded; empty = none
};

/// Undoes distortion and rolling shutter.
/// @param images of the camera's size; at most 253 different objects, and kUnsureObject.
[[nodiscard]] DepthView make_depth_view(const RecordedImages& images, const Camera& camera,
                                        const ReadOut& read_out = {});

}  // namespace ygslam
