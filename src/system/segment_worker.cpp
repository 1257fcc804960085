#include "system/segment_worker.hpp"

#include "core/log.hpp"
#include "core/trace.hpp"
#include "system/segment_safely.hpp"

namespace ygslam {
namespace {

constexpr double kPatienceAtEnd_s = 0.5;

}  // namespace

SegmentWorker::SegmentWorker(std::unique_ptr<Segmenter> segmenter)
    : shared_(std::make_shared<Shared>(std::move(segmenter))),
      thread_([shared = shared_](const std::stop_token& stop) { loop(*shared, stop); }) {}

SegmentWorker::~SegmentWorker() {
  thread_.request_stop();
  if (shared_->inbox.wait_idle(kPatienceAtEnd_s)) return;
  log::warn("the segmentation does not come back: it is left behind");
  thread_.detach();
}

SegmentWorker::Statistics SegmentWorker::statistics() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->statistics;
}

void SegmentWorker::loop(Shared& shared, const std::stop_token& stop) {
  trace::name_thread("segmentation");
  bool handed_over = false;
  while (const FramePtr frame = shared.inbox.take(stop)) {
    const trace::Span span("segment", frame->id);
    const ScopedTimer timer;
    Result<Segmentation> masks = segment_safely(*shared.segmenter, *frame);
    bool first_failure = false;
    const bool hands_over = masks.ok() && masks->by_fallback && !std::exchange(handed_over, true);
    {
      const std::lock_guard lock(shared.mutex);
      shared.statistics.times.add(timer);
      if (!masks.ok()) first_failure = shared.statistics.failed++ == 0;
    }
    // Left behind, it is silent: whom the line would go to may be gone.
    if (first_failure && !stop.stop_requested()) log::warn("{}", masks.error().message);
    if (hands_over && !stop.stop_requested())
      log::warn("the model takes too long for a camera: the built-in network goes on");
    if (masks.ok())
      shared.masks.push(std::make_shared<const Segmentation>(std::move(masks).value()));
    shared.inbox.done();
  }
}

}  // namespace ygslam
