// Lines for a human: log::warn("{}: {} lines left out", file, count). Where they go belongs to the
// thread, so that two systems in one process do not mix theirs: see ScopedSink and WorkerThread.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <utility>

namespace ygslam::log {

enum class Level { kInfo, kWarning, kError };
/// May be called from several threads at once; what it throws is ignored.
using Sink = std::function<void(Level, const std::string&)>;
using SinkPtr = std::shared_ptr<const Sink>;

namespace detail {
// A pointer: what has a destructor costs memory at its first use in a thread, and where there is
// none the C library ends the program.
inline constinit thread_local const SinkPtr* sink = nullptr;
}  // namespace detail

/// The calling thread's; null: warnings and errors go to standard error.
[[nodiscard]] inline SinkPtr thread_sink() { return detail::sink ? *detail::sink : nullptr; }

/// The calling thread logs to `sink` while this lives.
class ScopedSink {
 public:
  explicit ScopedSink(SinkPtr sink)
      : sink_(std::move(sink)), before_(std::exchange(detail::sink, &sink_)) {}
  ScopedSink(const ScopedSink&) = delete;
  ScopedSink& operator=(const ScopedSink&) = delete;
  ~ScopedSink() { detail::sink = before_; }

 private:
  const SinkPtr sink_;
  const SinkPtr* const before_;
};

inline void write(Level level, const std::string& line) noexcept {
  try {
    if (const SinkPtr sink = thread_sink()) {
      (*sink)(level, line);
    } else if (level != Level::kInfo) {
      std::fprintf(stderr, "%s: %s\n", level == Level::kError ? "error" : "warning", line.c_str());
    }
  } catch (...) {  // a line is not worth a run
  }
}

template <typename... Arguments>
void info(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  write(Level::kInfo, fmt::format(format, std::forward<Arguments>(arguments)...));
}
template <typename... Arguments>
void warn(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  write(Level::kWarning, fmt::format(format, std::forward<Arguments>(arguments)...));
}
template <typename... Arguments>
void error(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  write(Level::kError, fmt::format(format, std::forward<Arguments>(arguments)...));
}

}  // namespace ygslam::log
