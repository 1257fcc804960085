// From the raw outputs of a YOLOv8-seg network to instances and masks of the recorded image.
// Layout: standard Ultralytics export, https://docs.ultralytics.com/tasks/segment; prototype masks
// after Bolya et al., "YOLACT", ICCV 2019, eq. (1).
#pragma once

#include <span>
#include <vector>

#include "segment/letterbox.hpp"
#include "segment/segmenter.hpp"

namespace ygslam {

inline constexpr int kYoloBoxValues = 4;  ///< centre x, centre y, width, height [network px]
inline constexpr int kYoloClasses = 80;
inline constexpr int kYoloCoefficients = 32;
inline constexpr int kYoloChannels = kYoloBoxValues + kYoloClasses + kYoloCoefficients;
inline constexpr int kMaxInstances = 255;  ///< ids are bytes, 0 = none

/// The network's two outputs, as they lie in memory.
struct YoloOutputs {
  std::span<const float> detections;  ///< kYoloChannels x cells, row-major
  int cells = 0;
  std::span<const float> prototypes;  ///< kYoloCoefficients x proto_height x proto_width
  int proto_width = 0, proto_height = 0;
};

struct DecodeConfig {
  double score_threshold = 0.25;
  double nms_iou = 0.7;      ///< of two boxes of one class that overlap more, the better stays
  int max_instances = 32;    ///< the best are kept; at most kMaxInstances
  std::vector<int> classes;  ///< wanted classes; empty = all
  /// The other classes as well, after the wanted ones and as many again, on pixels those left free.
  bool others = false;
  double others_threshold = 0.12;  ///< score of the other classes: the map sums it up over views
};

struct DecodedYolo {
  /// The wanted ones, then the others; each best score first, boxes clipped to the image.
  std::vector<Instance> instances;
  GreyImage ids;     ///< recorded-image size; see Segmentation::ids
  int rejected = 0;  ///< detections that made no sense (NaN, scores outside 0..1, empty boxes)
};

/// Never fails: what makes no sense is rejected and counted. A cell takes the best of the wanted
/// classes, also where an unwanted one scores better: a person taken for a teddy bear moves too. So
/// another class whose box is that of a wanted one is left out.
/// @param box placement of the image in the input, of the size the network ran at.
[[nodiscard]] DecodedYolo decode_yolo(const YoloOutputs& outputs, const Letterbox& box,
                                      const DecodeConfig& config);

/// Intersection over union of two boxes; 0 where either is empty.
[[nodiscard]] float box_iou(const Instance& a, const Instance& b);

/// Greedy class-aware non-maximum suppression. @return indices into `candidates`, best score first
/// (of equal scores the earlier one), at most `limit`; no two of one class overlap above `max_iou`.
[[nodiscard]] std::vector<int> suppress_overlaps(std::span<const Instance> candidates,
                                                 double max_iou, int limit);

}  // namespace ygslam
