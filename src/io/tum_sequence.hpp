// A recorded RGB-D sequence in TUM layout: which image pairs there are, and the camera.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "geometry/camera.hpp"
#include "io/image_list.hpp"

namespace ygslam {

/// One registered pair as listed; the images may still turn out unreadable.
struct SequencePair {
  Timestamp stamp;   ///< of the colour image, strictly increasing over the sequence
  int decimals = 0;  ///< digits after the point of the colour stamp as written
  Timestamp depth_stamp;
  std::string colour_file, depth_file;  ///< relative to the root
};

struct TumSequence {
  std::filesystem::path root;
  std::vector<SequencePair> pairs;
  int stamp_decimals =
      6;                ///< the most digits any colour stamp was written with: use them for output
  CameraConfig camera;  ///< complete, width and height included
  std::string camera_source;   ///< "calibration.txt", "preset TUM freiburg1", ...
  std::string shutter_source;  ///< where its shutter's times come from, for the log; empty: nowhere
  int colour_channels = 3;     ///< of the first readable colour image: 3, or 1 for grey recordings
  std::optional<std::filesystem::path> groundtruth;
  ListCounts counts;
  std::vector<std::string> warnings;  ///< one line each, for the log
};

/// Reads the lists and the camera of a folder; no image is decoded yet, only headers are looked at
/// until one is readable.
/// @param camera replaces calibration.txt and presets; width or height <= 0: as the first image.
/// @return kInput: no folder, no list, nothing usable in it, less than 10 % of the colour images
/// have a depth image, no image header readable. kConfig: no camera known, or one with impossible
/// values (file, line and key are named).
[[nodiscard]] Result<TumSequence> open_tum_sequence(const std::filesystem::path& root,
                                                    const std::optional<CameraConfig>& camera = {});

}  // namespace ygslam
