// What push() needs: one frame that waits, results that wait, and the thread between them.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>

#include "core/worker_thread.hpp"
#include "facade/input.hpp"

namespace ygslam::api {

class PushThread {
 public:
  using Process = std::function<Result(const Input&)>;
  /// @param process called in the thread, one frame at a time. @param deliver takes the results in
  /// place of poll(), if it is not empty.
  PushThread(Process process, std::function<void(const Result&)> deliver);
  /// Lets go of the frame that waits.
  ~PushThread();
  PushThread(const PushThread&) = delete;
  PushThread& operator=(const PushThread&) = delete;

  /// Takes the place of a frame that still waits, and its motion along.
  void put(Input input);
  [[nodiscard]] std::optional<Result> poll();
  /// Lets go of the frame that waits and of all results; waits for that of the frame in process.
  /// Not to be called by `deliver`.
  void clear();
  /// The frame that waits is still processed. May be called again.
  void finish();
  /// Throws what the thread ended with, if it was an exception.
  void rethrow() const { thread_.rethrow(); }

 private:
  static constexpr std::size_t kMostResults = 64;
  void loop(const std::stop_token& stop);
  [[nodiscard]] std::optional<Input> take(const std::stop_token& stop);
  void hand_out(Result result);
  void rest();

  Process process_;
  std::function<void(const Result&)> deliver_;
  std::mutex mutex_;  // of what follows
  std::condition_variable_any came_;
  std::optional<Input> waiting_;
  std::deque<Result> results_;
  int dropped_ = 0;
  std::condition_variable idle_;
  bool is_busy_ = false;  // a frame is processed, or its result delivered
  bool closed_ = false;
  WorkerThread thread_;  // last: it uses everything above
};

}  // namespace ygslam::api
