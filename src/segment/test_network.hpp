// For tests: an untrained network with the outputs of a YOLOv8-seg export whose answer is known.
#pragma once

#include <filesystem>
#include <limits>
#include <memory>

namespace ov {
class Model;
}

namespace ygslam::testing {

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

/// Writes `network` as OpenVINO IR: `file` (.xml) and the weights beside it.
void write_network(const std::shared_ptr<ov::Model>& network, const std::filesystem::path& file);

}  // namespace ygslam::testing
