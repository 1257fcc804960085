#include "system/dense_thread.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <utility>

#include "core/time.hpp"

namespace ygslam {
namespace {

constexpr int kNice = 10;           // tracking, mapping and the network go first
constexpr double kMostShare = 0.1;  // of the thread's time, for the sink

}  // namespace

DenseThread::DenseThread(const DenseMapConfig& config, const Camera& camera, DenseSink sink)
    : map_(config, camera),
      sink_(std::move(sink)),
      thread_([this](const std::stop_token& stop) { loop(stop); }, [this] { queue_.close(); }) {}

DenseThread::~DenseThread() {
  thread_.request_stop();
  queue_.close();
}

void DenseThread::loop(const std::stop_token& stop) {
  static_cast<void>(::setpriority(PRIO_PROCESS, 0, kNice));  // of this thread alone, on Linux
  while (!stop.stop_requested()) {
    if (auto update = next(stop)) {
      work_off(*update, stop);
    } else if (queue_.is_closed()) {
      return;
    }
    const bool is_due = to_be_shown_ && std::chrono::steady_clock::now() >= next_show_;
    if (is_due && !stop.stop_requested()) show();
  }
}

void DenseThread::work_off(const DenseUpdate& update, const std::stop_token& stop) {
  {
    const std::lock_guard lock(mutex_);
    map_.apply(update);
  }
  while (!stop.stop_requested() && queue_.size() == 0 && step()) {
  }
  to_be_shown_ = static_cast<bool>(sink_.look);
}

/// @return nullopt: the end, or it is time to show the map.
std::optional<DenseUpdate> DenseThread::next(const std::stop_token& stop) {
  return to_be_shown_ ? queue_.pop_until(next_show_, stop) : queue_.pop(stop);
}

void DenseThread::show() {
  const ScopedTimer timer;
  {
    const std::lock_guard lock(mutex_);
    sink_.look(map_);
  }
  to_be_shown_ = false;
  const double wait_s = std::max(sink_.every_s, 1e-3 * timer.wall_ms() / kMostShare);
  next_show_ = std::chrono::steady_clock::now() +
               std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                   std::chrono::duration<double>(wait_s));
}

bool DenseThread::step() {
  const std::lock_guard lock(mutex_);
  return map_.step();
}

void DenseThread::inspect(const std::function<void(DenseMap&)>& look) {
  thread_.rethrow();
  const std::lock_guard lock(mutex_);
  look(map_);
}

void DenseThread::finish() {
  queue_.close();
  if (!thread_.joinable()) return;
  thread_.join();
  thread_.rethrow();
  map_.finish();
}

}  // namespace ygslam
