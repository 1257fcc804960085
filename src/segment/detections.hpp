// From what a network says row by row to instances and masks of the recorded image: what all kinds
// of networks have in common. A kind adds how its outputs are read (OutputDecoder).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "segment/class_table.hpp"
#include "segment/letterbox.hpp"
#include "segment/segmenter.hpp"

namespace ygslam {

inline constexpr int kMaxInstances = 255;  ///< ids are bytes, 0 = none

struct DecodeConfig {
  double score_threshold = 0.25;
  double nms_iou = 0.7;      ///< of two boxes of one class that overlap more, the better stays
  int max_instances = 32;    ///< the best are kept; at most kMaxInstances
  std::vector<int> classes;  ///< wanted COCO classes; empty = all
  /// The other classes as well, after the wanted ones and as many again, on pixels those left free.
  bool others = false;
  double others_threshold = 0.12;  ///< score of the other classes: the map sums it up over views
};

struct Decoded {
  /// The wanted ones, then the others; each best score first, boxes clipped to the image.
  std::vector<Instance> instances;
  GreyImage ids;     ///< recorded-image size; see Segmentation::ids
  int rejected = 0;  ///< detections that made no sense (NaN, scores outside 0..1, empty boxes)
};

/// A sigmoid may round above 1 in low precision. NaN is none.
[[nodiscard]] inline bool is_probability(float value) {
  constexpr float kSlack = 1e-3F;
  return value >= -kSlack && value <= 1.0F + kSlack;
}

/// Per row of an output the best of some classes.
struct RowScores {
  explicit RowScores(int rows) : score(rows, 0.0F), class_id(rows, 0) {}

  std::vector<float> score;   ///< 0: none
  std::vector<int> class_id;  ///< COCO's
  int invalid = 0;            ///< numbers that make no sense
};

/// Corners in pixels of the network's input.
struct NetworkBox {
  EdgePoint low, high;
};

/// Reads the outputs of one kind of network for one image.
class OutputDecoder {
 public:
  virtual ~OutputDecoder() = default;
  [[nodiscard]] virtual RowScores scores(const ClassSet& wanted) const = 0;
  /// @return nullopt if a number of it is not finite.
  [[nodiscard]] virtual std::optional<NetworkBox> box(int row) const = 0;
  /// Writes `id` where the row's mask is set, inside the instance's box, and `ids` is still 0.
  /// @return false if the mask has no pixel or makes no sense.
  [[nodiscard]] virtual bool paint(int row, const Instance& instance, std::uint8_t id,
                                   GreyImage& ids) = 0;
};

/// Never fails: what makes no sense is rejected and counted. A row takes the best of the wanted
/// classes, also where an unwanted one scores better: a person taken for a teddy bear moves too. So
/// another class whose box is that of a wanted one is left out.
/// @param box placement of the image in the input, of the size the network ran at.
[[nodiscard]] Decoded decode_detections(OutputDecoder& decoder, const Letterbox& box,
                                        const DecodeConfig& config);

/// Intersection over union of two boxes; 0 where either is empty.
[[nodiscard]] float box_iou(const Instance& a, const Instance& b);

/// Greedy class-aware non-maximum suppression. @return indices into `candidates`, best score first
/// (of equal scores the earlier one), at most `limit`; no two of one class overlap above `max_iou`.
[[nodiscard]] std::vector<int> suppress_overlaps(std::span<const Instance> candidates,
                                                 double max_iou, int limit);

}  // namespace ygslam
