// Whether the network computes on this processor what it computes elsewhere: a drawn person that it
// has to find. OpenVINO's kernels differ from processor to processor, and one that errs says
// nothing (docs/install.md, 64-bit ARM). Internal to this folder.
#pragma once

#include "geometry/camera.hpp"
#include "segment/segmenter.hpp"

namespace ygslam {

struct KnownPerson {
  CameraConfig camera;  ///< of the network's own grid
  RgbdFrame frame;      ///< depth alone is drawn
  GreyImage person;     ///< 1 where the person is seen, else 0
};
/// Somebody stands 2.5 m away, between floor and wall.
[[nodiscard]] KnownPerson draw_known_person();

/// IoU of all that the segmenter takes for people, of one made for `known.camera`, with the person
/// drawn. @return the segmenter's own error.
[[nodiscard]] Result<double> overlap_with(const KnownPerson& known, Segmenter& people);

/// @return kModel: the person was not found, or too much else was.
[[nodiscard]] Status check_finds(const KnownPerson& known, Segmenter& people);

}  // namespace ygslam
