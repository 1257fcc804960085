// What wheels tell beside the frames of a stream.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bag/bag_trajectory.hpp"
#include "bag/first_seconds.hpp"
#include "bag/frame_shares.hpp"
#include "geometry/imu.hpp"
#include "io/sequence.hpp"

namespace ygslam {

/// As StreamReadings.
class StreamOdometry {
 public:
  /// @param announced those of odometry, whatever has come.
  /// @return the chosen one's name, else as choose_poses().
  [[nodiscard]] Result<std::string> use(const std::string& choice,
                                        const std::vector<MotionTopic>& announced);
  void add(const BagTopic& topic, const BagMessage& message, std::int64_t shift_ns);
  void hand_out(FrameId id);
  [[nodiscard]] std::vector<OdometrySample> take(FrameId id) { return shares_.take(id); }
  /// What speaks against its first two seconds, said once; or how many of its poses are none, of
  /// very many at each power of ten.
  [[nodiscard]] std::vector<std::string> take_doubts() { return std::exchange(doubts_, {}); }

 private:
  void keep(const StampedPose& pose);
  void leave_out(std::size_t count);

  PoseReader early_;                 // until it is known which are wanted
  std::optional<std::string> name_;  // empty: none are
  FirstSeconds<StampedPose> first_;
  std::size_t left_out_ = 0;
  std::vector<std::string> doubts_;
  FrameShares<OdometrySample> shares_;
};

}  // namespace ygslam
