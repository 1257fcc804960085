// An IMU's readings beside the frames of a stream.
#pragma once

#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bag/bag.hpp"
#include "core/ids.hpp"
#include "geometry/imu.hpp"

namespace ygslam {

/// One thread reads the stream and takes what comes; what it has handed out any may take.
class StreamReadings {
 public:
  /// Until this or the first hand_out() all topics' are kept.
  void use(const std::string& topic);
  /// @param shift_ns is added to stamps.
  void add(const BagTopic& topic, const BagMessage& message, std::int64_t shift_ns);
  /// What was read by now belongs to this frame, however late somebody asks.
  void hand_out(FrameId id);
  /// Of this frame and those before it, what was not taken yet.
  [[nodiscard]] std::vector<ImuSample> take(FrameId id);

 private:
  struct Reading {
    std::string topic;
    ImuSample sample;
  };
  std::vector<Reading> early_;        // until it is known which are wanted
  std::optional<std::string> topic_;  // empty: none are
  std::vector<ImuSample> newest_;     // since the last frame
  std::mutex mutex_;
  std::deque<std::pair<FrameId, ImuSample>> handed_out_;
};

}  // namespace ygslam
