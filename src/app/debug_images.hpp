// Pictures of what the system saw: masks, static points green, dynamic points red (the paper's Fig.
// 5).
#pragma once

#include <deque>
#include <filesystem>
#include <set>
#include <string>

#include "app/frame_writer.hpp"

namespace ygslam {

/// A picture waits a few frames for the mask that was computed from its own frame.
class DebugImages final : public FrameWriter {
 public:
  /// @param every n-th frame is drawn, >= 1.
  DebugImages(std::filesystem::path directory, int every);

  [[nodiscard]] Status add(const FramePtr& frame, const TrackResult& result) override;
  /// Writes what still waits. Warns where pictures of an earlier run lie among them.
  [[nodiscard]] Status finish() override;

 private:
  struct Waiting {
    FramePtr frame;
    FeaturesPtr features;
    PointLabels labels;
    TrackState state;
    std::vector<TrackedObject> objects;
    SegmentationPtr masks;
  };
  [[nodiscard]] Status write(const Waiting& waiting);
  void warn_of_others() const;

  std::filesystem::path directory_;
  std::uint32_t every_;
  std::deque<Waiting> waiting_;
  std::set<std::string> written_;  // names
};

}  // namespace ygslam
