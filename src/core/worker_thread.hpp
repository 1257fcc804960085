// A std::jthread for a stage: it logs and is traced where its maker is, and an exception in it
// waits for the maker instead of ending the process.
#pragma once

#include <atomic>
#include <exception>
#include <memory>
#include <stop_token>
#include <thread>
#include <utility>

#include "core/log.hpp"
#include "core/trace.hpp"

namespace ygslam {

class WorkerThread {
 public:
  /// @param work void(std::stop_token). @param at_end called after it, however it ended: wakes
  /// those who wait for the thread; a failure is already there for rethrow().
  template <typename Work, typename AtEnd>
  WorkerThread(Work work, AtEnd at_end)
      : failure_(std::make_shared<Failure>()),
        thread_([failure = failure_, sink = log::thread_sink(), tracer = trace::thread_tracer(),
                 work = std::move(work), at_end = std::move(at_end)](const std::stop_token& stop) {
          const log::ScopedSink scope(sink);
          const trace::ScopedTracer traced(tracer);
          try {
            work(stop);
          } catch (...) {
            failure->exception = std::current_exception();
            failure->there.store(true, std::memory_order_release);
          }
          at_end();
        }) {}
  template <typename Work>
  explicit WorkerThread(Work work) : WorkerThread(std::move(work), [] {}) {}

  /// Throws what the thread ended with, if it was an exception.
  void rethrow() const {
    if (failure_->there.load(std::memory_order_acquire)) {
      std::rethrow_exception(failure_->exception);
    }
  }
  void request_stop() { thread_.request_stop(); }
  [[nodiscard]] bool stop_requested() const { return thread_.get_stop_token().stop_requested(); }
  void join() { thread_.join(); }
  [[nodiscard]] bool joinable() const { return thread_.joinable(); }
  void detach() { thread_.detach(); }

 private:
  struct Failure {
    std::exception_ptr exception;
    std::atomic<bool> there{false};
  };
  std::shared_ptr<Failure> failure_;
  std::jthread thread_;
};

}  // namespace ygslam
