#include "system/adjustment_thread.hpp"

#include "core/trace.hpp"

namespace ygslam {

void AdjustmentThread::start(FullAdjustment job) {
  give_up();
  abort_.store(false);
  thread_ = std::make_unique<WorkerThread>([this, job = std::move(job)](const std::stop_token&) {
    trace::name_thread("adjustment");
    auto patch = solve(camera_, job, config_, &abort_);
    const std::lock_guard lock(mutex_);
    result_ = std::move(patch);
  });
}

void AdjustmentThread::give_up() {
  abort_.store(true);
  if (thread_) {
    const trace::Span span("the adjustment", trace::Kind::kWait);
    if (thread_->joinable()) thread_->join();
    try {
      thread_->rethrow();
    } catch (...) {
      if (!failure_) failure_ = std::current_exception();
    }
    thread_.reset();
  }
  result_.reset();
}

std::optional<MapPatch> AdjustmentThread::take_result() {
  if (failure_) std::rethrow_exception(failure_);
  if (thread_) thread_->rethrow();
  const std::lock_guard lock(mutex_);
  return std::exchange(result_, std::nullopt);
}

void AdjustmentThread::finish() {
  if (!thread_) return;
  thread_->join();
  thread_->rethrow();
  thread_.reset();
}

}  // namespace ygslam
