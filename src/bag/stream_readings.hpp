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

/// One thread calls use(), add() and hand_out(); any thread may take(). Of more readings than are
/// kept the oldest go.
class StreamReadings {
 public:
  static constexpr std::size_t kMostWaiting = 100'000;  ///< that nobody has taken: minutes

  /// Until this or the first hand_out() all topics' are kept. Before another thread reads the
  /// stream.
  void use(const std::string& topic);
  /// @param shift_ns is added to stamps.
  void add(const BagTopic& topic, const BagMessage& message, std::int64_t shift_ns);
  /// What was read by now belongs to this frame, however late somebody asks.
  void hand_out(FrameId id);
  /// Of this frame and those before it, what was not taken yet.
  [[nodiscard]] std::vector<ImuSample> take(FrameId id);
  /// The topic, and what speaks against its first two seconds once they are there; said once.
  [[nodiscard]] std::string take_doubt() { return std::exchange(doubt_, {}); }

 private:
  struct Reading {
    std::string topic;
    ImuSample sample;
  };
  void keep(const ImuSample& reading);
  void judge(const ImuSample& reading);

  std::deque<Reading> early_;         // until it is known which are wanted
  std::optional<std::string> topic_;  // empty: none are
  std::deque<ImuSample> newest_;      // since the last frame
  std::vector<ImuSample> first_;      // until they are judged
  bool is_judged_ = false;
  std::string doubt_;
  std::mutex mutex_;
  std::deque<std::pair<FrameId, ImuSample>> handed_out_;
};

}  // namespace ygslam
