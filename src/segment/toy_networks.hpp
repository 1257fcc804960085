// For tests: untrained networks with the outputs of the exports of other makers, whose answers are
// known. Each undoes the normalisation of its own input, so that it sees something only where the
// image arrived as its kind wants it.
#pragma once

#include <memory>
#include <vector>

#include "image/image.hpp"

namespace ov {
class Model;
}

namespace ygslam::testing {

/// What a toy reports whatever the image. Its mask is where the image has kToyColour.
struct ToyDetection {
  float x0 = 0, y0 = 0, x1 = 0, y1 = 0;  ///< [network px]
  int label = 0;                         ///< the network's own number of the class
  float score = 0.9F;
};

inline constexpr Rgb8 kToyColour{200, 100, 50};
/// With the planes exchanged it would be kToyColour.
inline constexpr Rgb8 kToyBackground{50, 100, 200};

struct ToyNetwork {
  int width = 320, height = 256;
  std::vector<ToyDetection> detections;
  int rows = 300;  ///< yolo_end, rfdetr: rows of the output, those after the detections say nothing
  int classes = 91;          ///< rfdetr: logits per row
  bool masks_first = false;  ///< rtmdet, rfdetr: outputs in another order
  bool is_named = true;      ///< rtmdet, rfdetr: outputs are called dets, labels, masks
};

[[nodiscard]] std::shared_ptr<ov::Model> make_yolo_end_toy(const ToyNetwork& toy);
/// Suppresses with the operations of MMDeploy's export: as many rows as it finds and one of padding
/// that has no mask.
[[nodiscard]] std::shared_ptr<ov::Model> make_rtmdet_toy(const ToyNetwork& toy);
[[nodiscard]] std::shared_ptr<ov::Model> make_rfdetr_toy(const ToyNetwork& toy);

}  // namespace ygslam::testing
