// `ygslam run --background DIR`: the recording once more, without what moves in it.
#pragma once

#include <filesystem>
#include <span>

#include "core/histogram.hpp"
#include "core/result.hpp"
#include "dense/dense_map.hpp"
#include "io/frame_reader.hpp"
#include "segment/movable.hpp"
#include "system/frame_record.hpp"

namespace ygslam {

struct BackgroundJob {
  const Sequence& sequence;
  FrameReaderConfig reader;      ///< that the run's frames came from
  const Trajectory& trajectory;  ///< of the run
  const RevisedPoses& revised;
  const Map& map;
  const Camera& camera;
  Segmenter* segmenter = nullptr;  ///< null: without one
  const MovableClasses& movable;
  bool quiet = false;
};

struct BackgroundSummary {
  std::size_t frames = 0;
  int interrupted_by = 0;  ///< signal, after which no more frames were drawn
  /// Shares of all pixels.
  double from_views = 0, from_map = 0, never_seen = 0;
  Histogram draw_cpu_ms;  ///< of a frame, without reading, masks and writing
};

/// Writes rgb/, depth/ and source/ (PixelSource) of every frame that has a place in the map, and
/// the lists that make the folder a sequence; these last.
/// @return kOutput.
[[nodiscard]] Result<BackgroundSummary> write_background(const std::filesystem::path& folder,
                                                         const BackgroundJob& job, DenseMap& dense);

}  // namespace ygslam
