#include "io/frame_queue.hpp"

#include <algorithm>
#include <utility>

#include "core/trace.hpp"

namespace ygslam {
namespace {

constexpr const char* kName = "frames";  // in traces

}  // namespace

bool FrameQueue::push(OfferedFrame offered, bool is_paused) {
  std::unique_lock lock(mutex_);
  if (when_ == When::kFullWaits) {
    const auto is_over = [&] { return offered_.size() < capacity_ || closed_; };
    trace::wait(trace::Kind::kFull, kName, is_over, [&] { room_.wait(lock, is_over); });
  }
  if (closed_) return false;
  if (offered.frame) {
    if (frames_ >= capacity_) drop_oldest(is_paused);
    ++frames_;
  }
  offered_.push_back(std::move(offered));
  trace::length(kName, frames_);
  lock.unlock();
  available_.notify_one();
  return true;
}

void FrameQueue::drop_oldest(bool is_paused) {
  const auto oldest = std::ranges::find_if(
      offered_, [](const OfferedFrame& offered) { return offered.frame != nullptr; });
  trace::dropped(kName, oldest->id);
  oldest->frame = nullptr;
  oldest->is_dropped = true;
  oldest->while_paused = is_paused;
  --frames_;
  ++dropped_;
}

std::optional<OfferedFrame> FrameQueue::pop(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const auto is_over = [&] { return !offered_.empty() || closed_; };
  trace::wait(trace::Kind::kEmpty, kName, is_over, [&] { available_.wait(lock, stop, is_over); });
  if (offered_.empty() || stop.stop_requested()) return std::nullopt;
  std::optional<OfferedFrame> first(std::move(offered_.front()));
  offered_.pop_front();
  frames_ -= first->frame ? 1 : 0;
  trace::length(kName, frames_);
  lock.unlock();
  room_.notify_one();
  return first;
}

void FrameQueue::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  available_.notify_all();
  room_.notify_all();
}

std::size_t FrameQueue::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

bool FrameQueue::is_empty() const {
  const std::lock_guard lock(mutex_);
  return offered_.empty();
}

}  // namespace ygslam
