// What a run was like so far, for who comes late: a few figures of each frame.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bag/ros_messages.hpp"
#include "tracking/track_result.hpp"

namespace ygslam {

/// Of a bounded number of frames: once there are too many, every second one goes, and from then on
/// of as many frames as stand between two of them one is kept. The calls are not synchronised.
class RunHistory {
 public:
  static constexpr std::size_t kMostFrames = 2048;

  void add(const RgbdFrame& frame, const TrackResult& result);
  void clear() { *this = RunHistory(); }
  [[nodiscard]] std::size_t size() const { return frames_.size(); }

  /// A point where the camera was for each frame, in map as it was corrected then, with the fields
  /// t [s], frame, x y z [m], qx qy qz qw (the camera's axes as REP 103 has them), tracked (1; 0.5:
  /// weak, coasting or provisional; 0: lost, its pose is a guess), features_ms motion_ms pose_ms,
  /// static dynamic unknown (points), and mask_age (frames; -1: no mask).
  [[nodiscard]] ros::PointCloud2 message(Timestamp stamp) const;

 private:
  struct Frame {
    double t_s = 0;
    std::uint32_t number = 0;
    float tracked = 0;
    std::array<float, 7> pose{};  // x y z qx qy qz qw
    std::array<float, 3> times_ms{}, points{};
    float mask_age = -1;
  };
  std::vector<Frame> frames_;
  std::size_t seen_ = 0, stride_ = 1;
};

}  // namespace ygslam
