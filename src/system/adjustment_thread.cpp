#include "system/adjustment_thread.hpp"

#include <chrono>

#include "core/trace.hpp"
#include "optim/stop_flag.hpp"

namespace ygslam {
namespace {

constexpr std::chrono::milliseconds kLookUp{50};  // for a signal, which wakes nobody

}  // namespace

void AdjustmentThread::start(FullAdjustment job) {
  give_up();
  abort_.store(false);
  pending_ = true;
  const auto ended = std::make_shared<std::promise<void>>();
  ended_ = ended->get_future();
  thread_ = std::make_unique<WorkerThread>(
      [this, job = std::move(job)](const std::stop_token&) {
        trace::name_thread("adjustment");
        auto patch = solve(camera_, job, config_, &abort_);
        const std::lock_guard lock(mutex_);
        pending_ = patch.has_value();
        result_ = std::move(patch);
      },
      [ended] { ended->set_value(); });
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
  pending_ = false;
}

bool AdjustmentThread::is_pending() {
  const std::lock_guard lock(mutex_);
  return pending_;
}

std::optional<MapPatch> AdjustmentThread::take_result() {
  if (failure_) std::rethrow_exception(failure_);
  if (thread_) thread_->rethrow();
  const std::lock_guard lock(mutex_);
  if (result_) pending_ = false;
  return std::exchange(result_, std::nullopt);
}

void AdjustmentThread::finish(const std::atomic<bool>* abort) {
  if (!thread_) return;
  if (abort) {
    do {
      if (is_stopped(abort)) abort_.store(true);
    } while (ended_.wait_for(kLookUp) == std::future_status::timeout);
  }
  thread_->join();
  thread_->rethrow();
  thread_.reset();
}

}  // namespace ygslam
