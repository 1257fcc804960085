// An IMU's readings beside the frames of a stream.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bag/bag_imu.hpp"
#include "bag/first_seconds.hpp"
#include "bag/frame_shares.hpp"
#include "bag/imu_halves.hpp"

namespace ygslam {

/// One thread calls use(), add() and hand_out(); any thread may take(). Of more readings than are
/// kept the oldest go.
class StreamReadings {
 public:
  /// Until this or the first hand_out() all topics' are kept. Before another thread reads the
  /// stream.
  /// @param choice a topic, or empty. @param announced those with readings, whatever has come.
  /// @return as choose_imu().
  [[nodiscard]] Result<ImuTopics> use(const std::string& choice,
                                      const std::vector<MotionTopic>& announced);
  /// @param shift_ns is added to stamps.
  void add(const BagTopic& topic, const BagMessage& message, std::int64_t shift_ns);
  /// What was read by now belongs to this frame, however late somebody asks.
  void hand_out(FrameId id);
  /// Of this frame and those before it, what was not taken yet.
  [[nodiscard]] std::vector<ImuSample> take(FrameId id) { return shares_.take(id); }
  /// A topic, and what speaks against its first two seconds once they are there, said once; or how
  /// many of its readings are none, of very many at each power of ten.
  [[nodiscard]] std::vector<std::string> take_doubts() { return std::exchange(doubts_, {}); }

 private:
  struct Reading {
    std::string topic;
    ImuSample sample;
  };
  void leave_out(const std::string& topic);
  void sort(const Reading& reading);
  void keep(const ImuSample& reading);

  std::deque<Reading> early_;        // until it is known which are wanted
  std::optional<ImuTopics> topics_;  // of no name: none are
  ImuHalves halves_;
  FirstSeconds<ImuSample> first_;
  bool is_half_ = false;  // by its first seconds: not used
  std::size_t left_out_ = 0;
  std::vector<std::string> doubts_;
  FrameShares<ImuSample> shares_;
};

}  // namespace ygslam
