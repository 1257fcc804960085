#include "app/debug_images.hpp"

#include <cstdio>

#include "app/point_picture.hpp"
#include "core/counted.hpp"
#include "core/log.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kWaitFrames = 12;
}  // namespace

DebugImages::DebugImages(std::filesystem::path directory, int every)
    : directory_(std::move(directory)), every_(static_cast<std::uint32_t>(every)) {}

Status DebugImages::add(const FramePtr& frame, const TrackResult& result) {
  for (const SegmentationPtr& masks : result.masks) {
    for (Waiting& waiting : waiting_) {
      if (waiting.frame->id == masks->frame) waiting.masks = masks;
    }
  }
  if (index(frame->id) % every_ == 0) {
    waiting_.push_back(
        {frame, result.features, result.labels, result.state, result.objects, nullptr});
    for (const SegmentationPtr& masks : result.masks) {
      if (masks->frame == frame->id) waiting_.back().masks = masks;
    }
  }
  while (!waiting_.empty() &&
         (waiting_.front().masks ||
          index(frame->id) >= index(waiting_.front().frame->id) + kWaitFrames)) {
    Status written = write(waiting_.front());
    waiting_.pop_front();
    if (!written.ok()) return written;
  }
  return Ok{};
}

Status DebugImages::finish() {
  while (!waiting_.empty()) {
    Status written = write(waiting_.front());
    waiting_.pop_front();
    if (!written.ok()) return written;
  }
  warn_of_others();
  return Ok{};
}

void DebugImages::warn_of_others() const {
  std::size_t others = 0;
  std::error_code code;
  for (std::filesystem::directory_iterator at(directory_, code), end; !code && at != end;
       at.increment(code)) {
    const std::string name = at->path().filename().string();
    const bool is_ours = name.starts_with("frame_") && name.ends_with(".jpg");
    others += is_ours && !written_.contains(name) ? 1 : 0;
  }
  if (others > 0)
    log::warn("{}: {} of an earlier run beside those of this one", directory_.string(),
              counted(others, "picture"));
}

Status DebugImages::write(const Waiting& waiting) {
  cv::Mat picture = picture_of(*waiting.frame);
  if (waiting.masks) tint_masks(picture, waiting.masks->ids);
  draw_points(picture, *waiting.features, waiting.labels);
  draw_objects(picture, waiting.objects);
  const auto& labels = waiting.labels;
  draw_caption(picture, "frame " + std::to_string(index(waiting.frame->id)) + "  " +
                            to_string(waiting.state) + "  static " +
                            std::to_string(labels.static_points) + " (green)  dynamic " +
                            std::to_string(labels.dynamic_points) + " (red)  unknown " +
                            std::to_string(labels.unknown_points) + " (yellow)");
  char name[32];
  std::snprintf(name, sizeof name, "frame_%06u.jpg", index(waiting.frame->id));
  written_.insert(name);
  return write_jpeg(directory_ / name, picture);
}

}  // namespace ygslam
