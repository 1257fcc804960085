// From one listed pair to one immutable frame.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "image/depth.hpp"
#include "image/rgbd_frame.hpp"
#include "io/sequence.hpp"

namespace ygslam {

/// A frame, or the images of the pair that could not be used (both are looked at).
struct LoadedPair {
  Timestamp stamp;
  std::optional<RgbdFrame> frame;
  std::vector<SkippedImage> bad;
};

/// Puts a decoded pair together. @param id becomes the frame's id.
/// @param registration of the depth image to the colour image; null where it is registered.
[[nodiscard]] LoadedPair assembled_pair(const SequencePair& entry, FrameId id,
                                        Result<ColourImage> colour, Result<DepthImage> depth_m,
                                        const DepthRegistration* registration);

/// Decodes pair `position` of the sequence. Images of another size than the camera's, or of another
/// format, are refused, never converted.
/// @param position below sequence.pairs.size(). @param id becomes the frame's id.
[[nodiscard]] LoadedPair load_pair(const Sequence& sequence, std::size_t position, FrameId id,
                                   const DepthConfig& depth = {});

/// The same with the first fault as kInput; the frame's id is its position.
[[nodiscard]] Result<RgbdFrame> load_frame(const Sequence& sequence, std::size_t position,
                                           const DepthConfig& depth = {});

}  // namespace ygslam
