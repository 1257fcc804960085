// One registered colour and depth pair; never changes once made.
#pragma once

#include <memory>

#include "core/ids.hpp"
#include "core/time.hpp"
#include "image/image.hpp"

namespace ygslam {

struct RgbdFrame {
  FrameId id = kNoFrame;  ///< position in the input, 0, 1, ...
  Timestamp stamp;        ///< of the colour image
  ColourImage colour;
  GreyImage grey;
  DepthImage depth_m;        ///< registered to the colour image
  double depth_delay_s = 0;  ///< its stamp after that of the colour image
};
using FramePtr = std::shared_ptr<const RgbdFrame>;

}  // namespace ygslam
