// Pictures of what the system saw: masks, static points green, dynamic points red (the paper's Fig.
// 5).
#pragma once

#include <deque>
#include <filesystem>

#include "core/result.hpp"
#include "image/rgbd_frame.hpp"
#include "tracking/tracker.hpp"

namespace ygslam {

/// A picture waits a few frames for the mask that was computed from its own frame.
class DebugImages {
 public:
  /// @param every n-th frame is drawn, >= 1.
  DebugImages(std::filesystem::path directory, int every);

  [[nodiscard]] Status add(const FramePtr& frame, const TrackResult& result);
  /// Writes what still waits.
  [[nodiscard]] Status finish();

 private:
  struct Waiting {
    FramePtr frame;
    FeaturesPtr features;
    PointLabels labels;
    TrackState state;
    std::vector<TrackedObject> objects;
    SegmentationPtr masks;
  };
  [[nodiscard]] Status write(const Waiting& waiting) const;

  std::filesystem::path directory_;
  std::uint32_t every_;
  std::deque<Waiting> waiting_;
};

}  // namespace ygslam
