// Frames of a recording with their true poses.
#pragma once

#include <string>
#include <vector>

#include "geometry/camera.hpp"
#include "geometry/rolling_shutter.hpp"
#include "image/image.hpp"

namespace ygslam::bench {

struct PosedFrame {
  DepthImage depth_m;
  ColourImage colour;
  GreyImage movers;  ///< not 0: a mover; empty where the recording does not say
  SE3 T_world_camera;
  ReadOut read_out;
};

struct PosedRecording {
  CameraConfig camera;
  std::vector<PosedFrame> frames;
};

/// Every stride-th frame that has a true pose, at most `most` of them. Ends the program with a
/// message where there are none.
[[nodiscard]] PosedRecording load_posed(const std::string& sequence, std::size_t stride,
                                        std::size_t most);

}  // namespace ygslam::bench
