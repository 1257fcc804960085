// Frames that come once, in their order: from a pipe, from a camera.
#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "geometry/imu.hpp"
#include "io/frame_loader.hpp"

namespace ygslam {

struct StreamCounts {
  std::size_t without_depth = 0;  ///< colour images that no depth image belongs to
  std::size_t left_out = 0;       ///< images whose stamps cannot be right
};

/// One thread at a time may use it; any may ask for its counts and take readings.
class FrameStream {
 public:
  virtual ~FrameStream() = default;
  /// Waits for the next pair and decodes it. Of a time in which there are no pairs, the single
  /// images come as pairs that cannot be used. @return nullopt at the end, or once stopped.
  virtual std::optional<LoadedPair> next(FrameId id, const DepthConfig& depth,
                                         const std::stop_token& stop) = 0;
  /// Waits for the next pair and passes it over. @return false at the end, or once stopped.
  virtual bool skip(const std::stop_token& stop) = 0;
  [[nodiscard]] virtual StreamCounts counts() const = 0;

  /// Those with inertial readings that have been announced, by name.
  [[nodiscard]] virtual std::vector<std::string> imu_topics() const = 0;
  /// Keeps one's readings. Before the first frame is asked for.
  virtual void use_readings(const std::string& topic) = 0;
  /// Those that came before this frame was complete, and were not taken yet.
  [[nodiscard]] virtual std::vector<ImuSample> take_readings(FrameId id) = 0;
};

}  // namespace ygslam
