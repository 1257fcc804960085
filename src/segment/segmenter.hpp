// What a segmentation network says about one frame, and the interface behind which it sits.
#pragma once

#include <string>
#include <vector>

#include "core/result.hpp"
#include "image/rgbd_frame.hpp"
#include "scene/coco.hpp"

namespace ygslam {

/// One detected object. Box in pixels of the recorded image.
struct Instance {
  int class_id = 0;  ///< COCO class, 0 = person
  float score = 0;
  float x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// Instances of one frame. Always tagged with the frame it was computed from.
struct Segmentation {
  FrameId frame = kNoFrame;
  Timestamp stamp;
  std::vector<Instance> instances;  ///< at most 255
  GreyImage ids;    ///< per pixel: 0 = none, i + 1 = instances[i]; where masks overlap the better
                    ///< score wins
  int edge_px = 0;  ///< so far the edges of the masks may be off
  bool by_fallback = false;  ///< see make_fallback_segmenter()
};
using SegmentationPtr = std::shared_ptr<const Segmentation>;

class Segmenter {
 public:
  virtual ~Segmenter() = default;
  /// @return an error if this frame could not be segmented (the run goes on without its mask).
  [[nodiscard]] virtual Result<Segmentation> segment(const RgbdFrame& frame) = 0;
  /// Precision in use, e.g. "int8", "f32"; "recorded" for masks from files.
  [[nodiscard]] virtual std::string precision() const = 0;
  /// Quick enough to be awaited: a frame is tracked with its own mask. Else masks come when they
  /// are ready, some frames late.
  [[nodiscard]] virtual bool in_step() const { return false; }
};

}  // namespace ygslam
