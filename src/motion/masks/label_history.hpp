// Late masks: each labels the features of its own frame, and the labels follow the flow from frame
// to frame up to the current one. An old mask is never laid over a new image.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "core/ids.hpp"
#include "motion/flow/flow_field.hpp"
#include "motion/masks/mask_labels.hpp"

namespace ygslam {

struct LabelHistoryConfig {
  MaskConfig mask{};
  int history_frames = 30;       ///< a mask of an older frame comes too late
  int max_mask_age_frames = 30;  ///< a label older than this means unknown again
  FlowFieldConfig field{};       ///< neighbours of a feature without a link
  double vote_majority = 0.7;    ///< share of the neighbours' votes that must agree
};

struct SemanticPoint {
  SemanticLabel label = SemanticLabel::kUnknown;
  std::int16_t mask_age_frames = -1;  ///< frames since the mask that said so; -1 = none
  std::uint8_t instance = 0;          ///< id in that mask, 0 = none
  std::int16_t class_id = -1;         ///< of that instance, -1 = none
};

/// The features of the last frames, how they hang together, and what masks said about them.
class LabelHistory {
 public:
  explicit LabelHistory(LabelHistoryConfig config) : config_(std::move(config)) {}

  /// Appends the current frame; its labels are carried over from the frame before.
  /// @param link_to_previous index into the previous frame's features, or -1, per feature.
  /// @param ends where each feature of the previous frame ended; empty for the first frame.
  void push(FrameId frame, FeaturesPtr features, std::vector<std::int32_t> link_to_previous,
            std::span<const FlowEnd> ends, const DepthImage& depth_m);

  /// Takes in the mask of a frame still remembered and renews the labels of all frames since.
  /// @return false if the frame is not remembered, the mask is empty or of another size, or a newer
  /// mask has been used already.
  bool apply(const Segmentation& masks);

  /// Labels of the newest frame's features.
  [[nodiscard]] std::vector<SemanticPoint> current() const;
  /// Frames between the newest frame and the newest mask used; -1 if no mask is young enough.
  [[nodiscard]] int mask_age_frames() const;
  /// Flow ends of the newest step. Not to be called before the first push().
  [[nodiscard]] const FlowField& field() const { return entries_.back().field; }
  /// Depth of the newest frame.
  [[nodiscard]] const CoarseDepth& depth_m() const { return entries_.back().depth_m; }
  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  void clear();

 private:
  struct PointState {
    SemanticLabel label = SemanticLabel::kUnknown;
    std::uint8_t instance = 0;
    std::int16_t class_id = -1;
    std::int32_t source = -1;  // sequence number of the frame whose mask said so
  };
  struct Entry {
    FrameId frame = kNoFrame;
    std::int32_t sequence = 0;  // counts pushes
    FeaturesPtr features;
    std::vector<std::int32_t> link;
    FlowField field;
    CoarseDepth depth_m;
    int width = 0, height = 0;
    std::vector<PointState> points;
  };

  void carry(const Entry& from, Entry& to) const;
  [[nodiscard]] PointState vote(const Feature& feature, const FlowField& field,
                                std::span<const PointState> before) const;

  LabelHistoryConfig config_;
  std::deque<Entry> entries_;
  std::int32_t next_sequence_ = 0;
  std::int32_t newest_mask_ = -1;  // sequence number of the newest frame with a mask
};

}  // namespace ygslam
