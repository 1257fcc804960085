// Frames that were tracked before anybody knew how long the camera takes to read its rows.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "geometry/camera.hpp"
#include "system/frame_record.hpp"

namespace ygslam {

/// Keeps what such frames saw of the map, and finds their poses again when the time is known.
class EarlyFrames {
 public:
  void add(const FrameRecord& record, const TrackResult& result);
  /// @param map with the keyframes corrected (mapping/late_shutter). @return of the frames that saw
  /// enough of what is still in it.
  [[nodiscard]] RevisedPoses revised(const Map& map, const Camera& camera) const;

 private:
  struct Match {
    LandmarkId landmark;
    Eigen::Vector2f ideal_px;  ///< at the middle instant, as it was taken to be
    float row_px;              ///< where it was read
    float depth_m, weight;
    std::uint8_t octave;
    bool on_depth_edge, on_plane;
  };
  struct Frame {
    FrameId frame;
    Timestamp stamp;
    KeyframeRelativePose pose;
    ReadOut read_out;
    std::vector<Match> matches;
  };
  class Revision;

  void keep(const FrameRecord& record, const TrackResult& result);

  std::deque<Frame> waiting_;  // with the times in use now
  std::vector<Frame> early_;   // with times that were found to be wrong
  std::optional<ShutterTimes> times_;
};

}  // namespace ygslam
