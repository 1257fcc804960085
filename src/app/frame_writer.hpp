// What a run writes of each frame beside its own files, where it is asked to.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "app/run_options.hpp"
#include "image/rgbd_frame.hpp"
#include "tracking/tracker.hpp"

namespace ygslam {

class FrameWriter {
 public:
  virtual ~FrameWriter() = default;
  [[nodiscard]] virtual Status add(const FramePtr& frame, const TrackResult& result) = 0;
  /// After the last frame.
  [[nodiscard]] virtual Status finish() = 0;
};

/// All that a run was asked for. The first error ends the writing, not the run.
class FrameWriters {
 public:
  /// @return kOutput naming a folder that cannot be written.
  [[nodiscard]] static Result<FrameWriters> create(const RunOptions& options);

  void add(const FramePtr& frame, const TrackResult& result);
  /// @return the first error.
  [[nodiscard]] Status finish();

 private:
  std::vector<std::unique_ptr<FrameWriter>> writers_;
  std::optional<Error> error_;
};

}  // namespace ygslam
