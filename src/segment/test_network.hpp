// For tests: untrained networks whose answers are known.
#pragma once

#include <filesystem>
#include <limits>
#include <memory>
#include <string>

namespace ov {
class Model;
}

namespace ygslam::testing {

/// With the outputs of a YOLOv8-seg export.
struct TestNetwork {
  int width = 640, height = 480;  ///< 0: left open, as in an export with dynamic=True
  int channels = 4 + 80 + 32;     ///< of the detections
  int prototypes = 32;
  float score = 0.9F;  ///< of class 0 at every cell; NaN makes a network gone wrong
  bool quantised = false;
};

/// Every cell reports the same class-0 box, larger than any input; prototype 0 is the mean red of
/// each 4x4 block minus a half, and the box's only mask coefficient. So there is one instance, and
/// its mask is where the image is red.
[[nodiscard]] std::shared_ptr<ov::Model> make_test_network(const TestNetwork& shape);

/// The bytes of a people network as ONNX: its logit is `weight` times the channel that
/// says whether a cell was measured, so there are people where the image has depth.
[[nodiscard]] std::string people_onnx(float weight = 4, int channels = 5);

/// The bytes of a YOLO-seg network of three classes as ONNX, 32x32: whatever the image, class 1 in
/// the middle. @param names of its classes as Ultralytics writes them into the file; empty: none.
[[nodiscard]] std::string yolo_onnx(const std::string& names);

/// Writes `network` as OpenVINO IR: `file` (.xml) and the weights beside it.
void write_network(const std::shared_ptr<ov::Model>& network, const std::filesystem::path& file);

}  // namespace ygslam::testing
