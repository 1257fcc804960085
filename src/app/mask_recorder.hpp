// The network's masks as files, so that another run needs no network: --segmenter masks:DIR.
#pragma once

#include <filesystem>
#include <map>
#include <utility>

#include "app/frame_writer.hpp"

namespace ygslam {

/// Writes `directory`/STAMP.png (8-bit ids, 0 = none) and instances.json, which names the class of
/// each id. An id stands for the n-th instance of one class in its frame; scores are not kept.
class MaskRecorder final : public FrameWriter {
 public:
  explicit MaskRecorder(std::filesystem::path directory);

  [[nodiscard]] Status add(const FramePtr& frame, const TrackResult& result) override;
  [[nodiscard]] Status finish() override;

 private:
  [[nodiscard]] Status write(const Segmentation& masks);
  /// Of the n-th instance of a class; 0 where all ids are taken.
  std::uint8_t id_of(int class_id, int n);

  std::filesystem::path directory_;
  std::map<std::pair<int, int>, std::uint8_t> ids_;  // by class and number in the frame
  bool names_are_written_ = false;
  std::size_t left_out_ = 0;  // instances for which no id was left
};

}  // namespace ygslam
