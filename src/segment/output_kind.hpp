// The kinds of networks that are read, told apart by names and shapes of their outputs.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "segment/class_table.hpp"

namespace ygslam {

enum class OutputKind {
  kYolo,     ///< YOLOv8-seg, YOLO11-seg: boxes and scores of every cell, prototypes
  kYoloEnd,  ///< YOLO26-seg, end to end: finished detections, prototypes
  kRtmdet,   ///< RTMDet-Ins as MMDeploy exports it: finished detections and masks
  kRfdetr,   ///< RF-DETR-Seg as rfdetr exports it: queries with boxes, logits and masks
};

[[nodiscard]] const char* name_of(OutputKind kind);

inline constexpr std::int64_t kOpen = -1;  ///< a length that only a run tells

struct OutputShape {
  std::string name;  ///< may be empty
  std::vector<std::int64_t> lengths;
};

struct OutputLayout {
  OutputKind kind = OutputKind::kYolo;
  /// Which of the network's outputs is: detections and prototypes (YOLO); boxes, labels and masks.
  std::array<int, 3> order{0, 1, 2};
  ClassTable classes;
};

/// @param width, height of the network's input.
/// @param names of its classes, as its file tells; empty if it does not.
/// @return kModel: no kind that is read, with the outputs found and those accepted; or classes
/// that are not COCO's.
[[nodiscard]] Result<OutputLayout> recognise_outputs(const std::vector<OutputShape>& outputs,
                                                     int width, int height,
                                                     const ClassNames& names);

/// Cells of a YOLO network's input of this size: strides 8, 16, 32.
[[nodiscard]] int yolo_cells(int width, int height);

}  // namespace ygslam
