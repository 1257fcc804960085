#include "system/dense_thread.hpp"

#include <sys/resource.h>

namespace ygslam {
namespace {

constexpr int kNice = 10;  // tracking, mapping and the network go first

}  // namespace

DenseThread::DenseThread(const DenseMapConfig& config, const Camera& camera)
    : map_(config, camera),
      thread_([this](const std::stop_token& stop) { loop(stop); }, [this] { queue_.close(); }) {}

DenseThread::~DenseThread() {
  thread_.request_stop();
  queue_.close();
}

void DenseThread::loop(const std::stop_token& stop) {
  static_cast<void>(::setpriority(PRIO_PROCESS, 0, kNice));  // of this thread alone, on Linux
  while (auto update = queue_.pop(stop)) {
    {
      const std::lock_guard lock(mutex_);
      map_.apply(*update);
    }
    while (!stop.stop_requested() && queue_.size() == 0 && step()) {
    }
  }
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
