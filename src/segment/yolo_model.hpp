// A network file, read and found to be what the decoder understands. Internal to this folder.
#pragma once

#include <filesystem>
#include <memory>

#include "core/result.hpp"

namespace ov {
class Model;
}

namespace ygslam {

struct YoloLayout {
  int width = 0, height = 0;  ///< of the input [px], multiples of 32
  int cells = 0;
  int proto_width = 0, proto_height = 0;
  bool boxes_first = true;  ///< output 0 holds the detections, output 1 the prototypes
  bool quantised = false;   ///< has FakeQuantize operations: made for int8
};

/// What an input of this size gives in the standard export: strides 8, 16, 32; prototypes at 4.
[[nodiscard]] YoloLayout standard_layout(int width, int height);

struct YoloModel {
  std::shared_ptr<ov::Model> network;  ///< static shapes, f32 input and outputs
  YoloLayout layout;
};

/// Reads an ONNX or OpenVINO IR file. @param width, height used where the file leaves them open.
/// @return kModel with file and fault if it is no network or not of the standard export's shape.
[[nodiscard]] Result<YoloModel> read_yolo_model(const std::filesystem::path& file, int width,
                                                int height);

}  // namespace ygslam
