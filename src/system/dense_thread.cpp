#include "system/dense_thread.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <utility>

#include "core/time.hpp"
#include "core/trace.hpp"

namespace ygslam {
namespace {

constexpr int kNice = 10;           // tracking, mapping and the network go first
constexpr double kMostShare = 0.1;  // of the thread's time, for the sink
constexpr double kMostShareAtOnce = 0.05;
constexpr double kLongestWait_s = 0.15;  // of what is shown at once, however long it took

}  // namespace

DenseThread::DenseThread(const DenseMapConfig& config, const Camera& camera, DenseSink sink)
    : map_(config, camera),
      looks_{Look{std::move(sink.look_at_once), 0, kMostShareAtOnce, kLongestWait_s},
             Look{std::move(sink.look), sink.every_s, kMostShare}},
      thread_([this](const std::stop_token& stop) { loop(stop); }, [this] { queue_.close(); }) {}

DenseThread::~DenseThread() {
  thread_.request_stop();
  queue_.close();
}

void DenseThread::loop(const std::stop_token& stop) {
  static_cast<void>(::setpriority(PRIO_PROCESS, 0, kNice));  // of this thread alone, on Linux
  trace::name_thread("dense map");
  while (!stop.stop_requested()) {
    if (auto update = next(stop)) {
      work_off(std::move(*update), stop);
    } else if (queue_.is_drained()) {
      return;
    }
    show_if_due(stop);
  }
}

void DenseThread::work_off(DenseUpdate update, const std::stop_token& stop) {
  {
    const auto lock = locked_after_looks();
    map_.apply(update);
  }
  frames_waiting_ -= update.added.size();
  update = {};  // with its images, which are packed by now
  for (Look& look : looks_) look.waits = static_cast<bool>(look.look);
  while (!stop.stop_requested() && queue_.size() == 0 && step()) {
    for (Look& look : looks_) look.waits = static_cast<bool>(look.look);
    show_if_due(stop);  // the steps may take longer than the map may be old
  }
}

/// @return nullopt: the end, or it is time to show the map.
std::optional<DenseUpdate> DenseThread::next(const std::stop_token& stop) {
  std::optional<std::chrono::steady_clock::time_point> next;
  for (const Look& look : looks_)
    if (look.waits) next = std::min(next.value_or(look.next), look.next);
  return next ? queue_.pop_until(*next, stop) : queue_.pop(stop);
}

void DenseThread::show_if_due(const std::stop_token& stop) {
  for (Look& look : looks_) {
    if (!look.waits || stop.stop_requested() || std::chrono::steady_clock::now() < look.next)
      continue;
    const ScopedTimer timer;
    {
      const trace::Span span("show");
      const auto lock = locked_after_looks();
      map_.expect_looks();
      look.look(map_);
    }
    look.waits = false;
    // Of the processor: who has to wait for one took nothing.
    const double share_s = 1e-3 * timer.cpu_ms() / look.most_share;
    const double wait_s =
        std::clamp(share_s, look.every_s, std::max(look.every_s, look.most_wait_s));
    look.next = std::chrono::steady_clock::now() +
                std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                    std::chrono::duration<double>(wait_s));
  }
}

bool DenseThread::step() {
  const auto lock = locked_after_looks();
  const trace::Span span("update a view");
  return map_.step();
}

void DenseThread::inspect(const std::function<void(DenseMap&)>& look) {
  thread_.rethrow();
  ++looks_waiting_;
  const auto lock = locked();
  --looks_waiting_;
  looks_waiting_.notify_all();
  map_.expect_looks();
  look(map_);
}

void DenseThread::restore(const std::vector<SavedView>& views) {
  const auto lock = locked();
  map_.restore(views);
}

std::unique_lock<std::mutex> DenseThread::locked() {
  std::unique_lock lock(mutex_, std::try_to_lock);
  const auto is_over = [&] { return lock.owns_lock(); };
  trace::wait(trace::Kind::kWait, "the dense map", is_over, [&] {
    if (!lock) lock.lock();
  });
  return lock;
}

std::unique_lock<std::mutex> DenseThread::locked_after_looks() {
  for (int looks = looks_waiting_; looks > 0; looks = looks_waiting_) looks_waiting_.wait(looks);
  return locked();
}

void DenseThread::finish() {
  queue_.close();
  if (!thread_.joinable()) return;
  thread_.join();
  thread_.rethrow();
  map_.finish();
}

}  // namespace ygslam
