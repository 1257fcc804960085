// Frames that an IMU or wheels alone carried on, placed again once the camera sees where it has
// come to.
#pragma once

#include <vector>

#include "tracking/retracker.hpp"

namespace ygslam {

class Coasting {
 public:
  /// A frame without a pose of its own. @param T_now_last its motion since the last frame with one,
  /// as predicted.
  void add(FrameId frame, Timestamp stamp, const SE3& T_now_last) {
    frames_.push_back({frame, stamp, T_now_last});
  }
  void forget() { frames_.clear(); }

  /// The frame after them has a pose again.
  /// @param last the last frame before them, at `last_stamp`. @param T_now_last, T_predicted_last
  /// the camera's motion since then, as found and as predicted.
  /// @return all of them, each with its share of what the prediction had drifted by then.
  [[nodiscard]] std::vector<RetrackedFrame> found_again(const KeyframeRelativePose& last,
                                                        Timestamp last_stamp, Timestamp now,
                                                        const SE3& T_now_last,
                                                        const SE3& T_predicted_last);

 private:
  struct Frame {
    FrameId frame;
    Timestamp stamp;
    SE3 T_now_last;
  };
  std::vector<Frame> frames_;
};

}  // namespace ygslam
