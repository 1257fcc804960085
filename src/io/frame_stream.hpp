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

/// What was kept beside the frames.
struct StreamMotion {
  std::vector<ImuSample> imu;
  std::vector<OdometrySample> wheels;
};

/// One thread at a time may use it; any may ask for its counts and take motion.
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

  /// Keeps an IMU's readings. Before the first frame is asked for.
  /// @param choice a topic; empty: the only one, or the only two that are halves.
  /// @return the topic whose frame they are in; kInput with a reason alone: none, several.
  virtual Result<std::string> use_imu(const std::string& choice) = 0;
  /// The same of odometry.
  virtual Result<std::string> use_odometry(const std::string& choice) = 0;
  /// What came before this frame was complete, and was not taken yet.
  [[nodiscard]] virtual StreamMotion take_motion(FrameId id) = 0;
};

}  // namespace ygslam
