// What the threads of a run do and when, in Chrome's Trace Event format, which
// https://ui.perfetto.dev and chrome://tracing open. Threads put their events into buffers of their
// own and never wait; one that is full loses events, which are counted.
#pragma once

#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/trace.hpp"
#include "core/worker_thread.hpp"
#include "io/growing_file.hpp"

namespace ygslam {

class TraceBuffers;

class TraceWriter {
 public:
  /// Whether start() can be expected to do; nothing is written. @return its errors.
  [[nodiscard]] static Status check(const std::filesystem::path& path);

  /// Times count from here. @param capacity events that a thread may be ahead of the file.
  explicit TraceWriter(std::size_t capacity = kCapacity);
  TraceWriter(const TraceWriter&) = delete;
  TraceWriter& operator=(const TraceWriter&) = delete;
  ~TraceWriter();

  /// For ScopedTracer; may outlive the writer.
  [[nodiscard]] trace::TracerPtr tracer() const;
  /// Writes what has come and what comes, in a thread of its own, from now on.
  /// @return as create_growing_file().
  [[nodiscard]] Status start(const std::filesystem::path& path);
  /// Writes the rest and closes the file. @return what could not be written (kOutput).
  [[nodiscard]] Status finish();
  /// Events that came while their thread's buffer was full, so far.
  [[nodiscard]] std::uint64_t dropped() const;

 private:
  static constexpr std::size_t kCapacity = 4096;
  void write_what_came();
  void put(const std::string& text);

  std::shared_ptr<TraceBuffers> buffers_;
  std::filesystem::path path_;
  FilePtr file_;  // null: not started, or finished
  std::optional<Error> failed_;
  std::mutex mutex_;  // for wake_ alone
  std::condition_variable_any wake_;
  std::optional<WorkerThread> thread_;  // last: it uses everything above
};

}  // namespace ygslam
