// Masks that come with the frames, from a network elsewhere.
#pragma once

#include <deque>
#include <memory>
#include <mutex>

#include "segment/segmenter.hpp"

namespace ygslam {

/// Where they wait for their frames' turn. Any thread may use it.
class GivenMasks {
 public:
  /// Before their frame is processed.
  void put(SegmentationPtr masks);
  /// @return null where the frame came without. Those of earlier frames are let go.
  [[nodiscard]] SegmentationPtr take(FrameId frame);

 private:
  static constexpr std::size_t kMost = 8;
  std::mutex mutex_;
  std::deque<SegmentationPtr> waiting_;  // oldest first
};

/// A frame that came without masks is an error of that frame.
[[nodiscard]] std::unique_ptr<Segmenter> make_given_segmenter(std::shared_ptr<GivenMasks> masks);

}  // namespace ygslam
