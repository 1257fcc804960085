// The room behind the people: a frame without what moves in it. Hidden pixels show the dense map's
// surface in the colours of the keyframes that saw it best.
#pragma once

#include "dense/background/frame_geometry.hpp"
#include "dense/background/mesh_view.hpp"
#include "dense/background/thin_structures.hpp"
#include "dense/background/view_colours.hpp"
#include "dense/dense_map.hpp"
#include "image/rgbd_frame.hpp"

namespace ygslam {

struct BackgroundPicture {
  ColourImage colour;
  DepthImage depth_m;  ///< 0 = none
  GreyImage source;    ///< values of PixelSource
};

/// What of a frame is not shown as it is: movers with a margin around them, and whatever stands
/// where the map knows that space is free.
/// @param movers 255 where something is that may move; empty = none known. @return 255 or 0.
[[nodiscard]] GreyImage hidden_pixels(const RgbdFrame& frame, const GreyImage& movers,
                                      const FrameGeometry& geometry, const DenseMap& map);

/// A frame that is no keyframe may show what keyframes do not: what people uncover as they walk.
/// Such a frame is put into the map.
/// @return whether it was.
bool add_what_is_new(const RgbdFrame& frame, const GreyImage& hidden, const FrameGeometry& geometry,
                     const ReadOut& read_out, DenseMap& map);

/// Of one state of the map, which must stay as it is and live longer.
class Background {
 public:
  explicit Background(DenseMap& map);

  /// @param hidden see hidden_pixels().
  [[nodiscard]] BackgroundPicture step(const RgbdFrame& frame, const GreyImage& hidden,
                                       const FrameGeometry& geometry);

 private:
  MeshView mesh_;
  ThinStructures thin_;
  ViewColours colours_;
};

}  // namespace ygslam
