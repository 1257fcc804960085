#include "app/frame_writer.hpp"

#include "app/debug_images.hpp"
#include "app/mask_recorder.hpp"
#include "io/atomic_file.hpp"

namespace ygslam {

Result<FrameWriters> FrameWriters::create(const RunOptions& options) {
  FrameWriters all;
  for (const std::string& folder : {options.debug_dir, options.masks_dir}) {
    if (folder.empty()) continue;
    if (Status writable = ensure_writable_directory(folder); !writable.ok())
      return writable.error();
  }
  if (!options.debug_dir.empty())
    all.writers_.push_back(std::make_unique<DebugImages>(options.debug_dir, options.debug_every));
  if (!options.masks_dir.empty())
    all.writers_.push_back(std::make_unique<MaskRecorder>(options.masks_dir));
  return all;
}

void FrameWriters::add(const FramePtr& frame, const TrackResult& result) {
  for (const auto& writer : writers_) {
    if (error_) return;
    if (Status written = writer->add(frame, result); !written.ok()) error_ = written.error();
  }
}

Status FrameWriters::finish() {
  for (const auto& writer : writers_) {
    if (error_) return *error_;
    if (Status written = writer->finish(); !written.ok()) error_ = written.error();
  }
  return error_ ? Status(*error_) : Ok{};
}

}  // namespace ygslam
