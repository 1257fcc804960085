// How well things were tracked over time: HOTA (Luiten et al. 2021), IDF1 (Ristani et al. 2016) and
// CLEAR MOT (Bernardin, Stiefelhagen 2008), with TrackEval's conventions where a paper leaves a
// choice.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <span>
#include <vector>

#include "image/pixel_box.hpp"

namespace ygslam {

/// Where one thing is in a frame.
struct IdBox {
  int id = 0;
  PixelBox box;
  bool counts = true;  ///< of truths: false = need not be found, may be found (MOT's "ignore")
};
struct BoxFrame {
  std::vector<IdBox> truth, tracked;
};

/// Which things there were in a frame, which were tracked, and how alike they are.
struct SimilarityFrame {
  std::vector<int> truth, tracked;  ///< ids, each once
  Eigen::MatrixXd similarity;       ///< 0 to 1, a row per truth, a column per tracked
};

/// Two boxes this alike (IoU) show the same thing; HOTA takes the mean over many such limits.
inline constexpr double kSameBoxIou = 0.5;

/// IoU of the boxes. A tracked one is left out that fits best to a truth that does not count, or
/// that shows nothing else and lies half in such a one (as KITTI's "don't care").
[[nodiscard]] SimilarityFrame compare(const BoxFrame& frame);

struct TrackingScore {
  double hota = 0, det_a = 0, ass_a = 0;  ///< means over alpha = 0.05, 0.1, ..., 0.95
  double idf1 = 0, id_precision = 0, id_recall = 0;
  double mota = 0;
  std::size_t found = 0, missed = 0, false_alarms = 0;  ///< boxes, as CLEAR pairs them
  std::size_t id_switches = 0;
  std::map<int, std::size_t> truth_frames;  ///< frames by id
  std::map<int, std::size_t> switches;      ///< by truth id, only those that had some
  std::map<int, std::size_t> tracked_frames;
  std::map<int, std::size_t> false_frames;  ///< by tracked id: paired with nothing
};

[[nodiscard]] TrackingScore score_tracking(std::span<const SimilarityFrame> frames);

}  // namespace ygslam
