// A sequence out of a bag.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "io/sequence.hpp"

namespace ygslam {

/// Which messages of a bag are the sequence; empty: whatever is the only one of its kind.
struct BagTopics {
  std::string rgb, depth;
};

/// Reads through the whole bag once; its images are decoded later.
/// @param cameras in place of the bag's CameraInfo; width or height <= 0: as the first image.
/// @param interrupted asked from time to time while it reads; may be empty.
/// @return kInput: no bag, interrupted, no images in it or several topics of them, fewer than 10 %
/// of the colour images have a depth image. kConfig: no usable camera.
[[nodiscard]] Result<Sequence> open_bag_sequence(const std::filesystem::path& path,
                                                 const BagTopics& topics,
                                                 const GivenCameras& cameras,
                                                 const std::function<bool()>& interrupted = {});

}  // namespace ygslam
