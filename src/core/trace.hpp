// What threads do and when, for whoever asked for a trace. As the log's (log.hpp), its destination
// belongs to the thread, and its workers go on with it (WorkerThread); a thread without a name, or
// without a destination, which is the rule, pays a look at a pointer.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <utility>

#include "core/ids.hpp"
#include "core/time.hpp"

namespace ygslam::trace {

enum class Kind : std::uint8_t {
  kStage,    ///< work
  kWait,     ///< stands still for something
  kEmpty,    ///< ... for the next entry of a queue
  kFull,     ///< ... for room in a queue
  kLength,   ///< of a queue, from this instant on
  kDropped,  ///< nobody will see it
};

struct Event {
  Kind kind = Kind::kStage;
  const char* name = nullptr;  ///< lives as long as the program
  std::int64_t begin_ns = 0;   ///< of the steady clock
  std::int64_t wall_ns = 0, cpu_ns = 0;
  std::int64_t length = 0;  ///< of a queue
  FrameId frame = kNoFrame;
};

/// Of one thread, which alone adds to it.
class Track {
 public:
  virtual ~Track() = default;
  /// Never waits.
  virtual void add(const Event& event) noexcept = 0;
};

/// Lives as long as the last thread that has it.
class Tracer {
 public:
  virtual ~Tracer() = default;
  /// @param thread what it is called; one that ended may have left its track to the next.
  [[nodiscard]] virtual std::unique_ptr<Track> track(const char* thread) = 0;
};
using TracerPtr = std::shared_ptr<Tracer>;

namespace detail {
struct Thread {
  TracerPtr tracer;
  std::unique_ptr<Track> track{};  // null until it has a name
  FrameId frame = kNoFrame;        // that it works on
};
// A pointer: see log::detail::sink.
inline constinit thread_local Thread* thread = nullptr;

[[nodiscard]] inline Thread* traced() { return thread && thread->track ? thread : nullptr; }
[[nodiscard]] inline std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}
}  // namespace detail

/// The calling thread's; null: it is not traced.
[[nodiscard]] inline TracerPtr thread_tracer() {
  return detail::thread ? detail::thread->tracer : nullptr;
}

/// The calling thread is traced by `tracer`, from name_thread() on, while this lives.
class ScopedTracer {
 public:
  explicit ScopedTracer(TracerPtr tracer)
      : thread_{std::move(tracer)}, before_(std::exchange(detail::thread, &thread_)) {}
  ScopedTracer(const ScopedTracer&) = delete;
  ScopedTracer& operator=(const ScopedTracer&) = delete;
  ~ScopedTracer() { detail::thread = before_; }

 private:
  detail::Thread thread_;
  detail::Thread* const before_;
};

/// Gives the calling thread a track, where it is traced.
/// @param name lives as long as the program.
inline void name_thread(const char* name) {
  if (detail::thread && detail::thread->tracer)
    detail::thread->track = detail::thread->tracer->track(name);
}

/// A stage, or a wait, from here to the end of the scope. Names live as long as the program.
class Span {
 public:
  explicit Span(const char* name, Kind kind = Kind::kStage) : thread_(detail::traced()) {
    if (thread_) begin(name, kind, thread_->frame);
  }
  /// What is within it is of this frame, too.
  Span(const char* name, FrameId frame) : thread_(detail::traced()) {
    if (thread_) begin(name, Kind::kStage, frame);
  }
  Span(const Span&) = delete;
  Span& operator=(const Span&) = delete;
  ~Span() {
    if (thread_) end();
  }

 private:
  void begin(const char* name, Kind kind, FrameId frame) {
    event_.kind = kind;
    event_.name = name;
    event_.frame = frame;
    outer_frame_ = std::exchange(thread_->frame, frame);
    event_.cpu_ns = thread_cpu_ns();
    event_.begin_ns = detail::now_ns();
  }
  void end() {
    event_.wall_ns = detail::now_ns() - event_.begin_ns;
    event_.cpu_ns = thread_cpu_ns() - event_.cpu_ns;
    thread_->frame = outer_frame_;
    thread_->track->add(event_);
  }

  detail::Thread* const thread_;
  Event event_;
  FrameId outer_frame_ = kNoFrame;
};

/// The wait until `is_over` holds, where it does not hold at once.
template <typename IsOver, typename WaitForIt>
void wait(Kind kind, const char* name, const IsOver& is_over, const WaitForIt& wait_for_it) {
  if (name == nullptr || detail::traced() == nullptr || is_over()) return wait_for_it();
  const Span span(name, kind);
  wait_for_it();
}

/// @param queue null: not of interest.
inline void length(const char* queue, std::size_t length) {
  if (detail::Thread* const thread = detail::traced(); thread && queue)
    thread->track->add({.kind = Kind::kLength,
                        .name = queue,
                        .begin_ns = detail::now_ns(),
                        .length = static_cast<std::int64_t>(length)});
}

/// An entry of a queue that nobody will take. @param queue null: not of interest.
inline void dropped(const char* queue, FrameId frame = kNoFrame) {
  if (detail::Thread* const thread = detail::traced(); thread && queue)
    thread->track->add({.kind = Kind::kDropped,
                        .name = queue,
                        .begin_ns = detail::now_ns(),
                        .frame = frame == kNoFrame ? thread->frame : frame});
}

}  // namespace ygslam::trace
