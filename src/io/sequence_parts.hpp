// What every kind of sequence does when it is opened, once it knows its images.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/sequence.hpp"

namespace ygslam {

/// Pairs colour and depth images by their stamps.
/// @param colour,depth stamps strictly increasing.
/// @return kInput where less than 10 % of the colour images have a depth image.
Status pair_images(const std::vector<ListedImage>& colour, const std::vector<ListedImage>& depth,
                   Sequence& sequence);

/// The median of |depth stamp - colour stamp|.
[[nodiscard]] std::int64_t median_difference_ns(const std::vector<SequencePair>& pairs);

/// Fills in what follows from pairs, images and camera: size, channels, shutter, digits of stamps.
/// @param camera width or height <= 0: as the first image that can be read.
/// @return kInput: no image header readable; kConfig: impossible values (file, line and key named).
Status complete_sequence(const CameraConfig& camera, Sequence& sequence);

/// The same where the header is at hand.
Status complete_sequence(const CameraConfig& camera, const ImageHeader& header, Sequence& sequence);

/// Takes depth images from a camera of its own; to be called when `camera` is complete.
/// @param depth width or height <= 0: as the first depth image that can be read; depth_scale 0: as
/// `camera` says.
/// @param source for messages: a file or a topic.
/// @return kConfig: impossible values, or another size than the images have; kInput: no image
/// header readable.
Status set_depth_camera(DepthCamera depth, const std::string& source, Sequence& sequence);

/// The same for a folder: as given, else of calibration_depth.txt; nothing where there is neither.
Status find_depth_camera(const GivenCameras& given, Sequence& sequence);

}  // namespace ygslam
