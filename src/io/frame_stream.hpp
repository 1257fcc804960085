// Frames that come once, in their order: from a pipe, from a camera.
#pragma once

#include <optional>
#include <stop_token>

#include "io/frame_loader.hpp"

namespace ygslam {

/// One thread at a time may use it.
class FrameStream {
 public:
  virtual ~FrameStream() = default;
  /// Waits for the next pair and decodes it. @return nullopt at the end, or once stopped.
  virtual std::optional<LoadedPair> next(FrameId id, const DepthConfig& depth,
                                         const std::stop_token& stop) = 0;
  /// Waits for the next pair and passes it over. @return false at the end, or once stopped.
  virtual bool skip(const std::stop_token& stop) = 0;
};

}  // namespace ygslam
