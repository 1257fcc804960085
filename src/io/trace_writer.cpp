#include "io/trace_writer.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <atomic>
#include <bit>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/check.hpp"

namespace ygslam {
namespace {

// Each further event begins with the comma before it: whatever ends the program, what is missing is
// the closing bracket, which the format allows to be missing.
constexpr std::string_view kTraceBegin =
    R"([
{"name":"process_name","ph":"M","pid":1,"args":{"name":"ygslam"}})";
constexpr std::string_view kTraceEnd = "\n]\n";
constexpr FileKind kTraceKind{"trace", kTraceBegin};
constexpr auto kWriteTraceEvery = std::chrono::milliseconds(50);
constexpr int kTraceNice = 10;  // the run goes first

std::string json_string(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

std::string thousandths(std::int64_t ns) { return fmt::format("{}.{:03}", ns / 1000, ns % 1000); }

std::string event_name(const trace::Event& event) {
  std::string name = event.name;
  switch (event.kind) {
    case trace::Kind::kWait:
      return "waits for " + name;
    case trace::Kind::kEmpty:
      return "queue is empty: " + name;
    case trace::Kind::kFull:
      return "queue is full: " + name;
    case trace::Kind::kLength:
      return "queue: " + name;
    case trace::Kind::kDropped:
      return "dropped: " + name;
    case trace::Kind::kStage:
      break;
  }
  return name;
}

const char* event_category(trace::Kind kind) {
  if (kind == trace::Kind::kStage) return "stage";
  if (kind == trace::Kind::kLength) return "queue";
  return kind == trace::Kind::kDropped ? "dropped" : "wait";
}

std::string frame_argument(const trace::Event& event) {
  return event.frame == kNoFrame ? "" : fmt::format(R"("frame":{})", index(event.frame));
}

/// What differs between the kinds.
std::string event_details(const trace::Event& event) {
  const std::string frame = frame_argument(event);
  if (event.kind == trace::Kind::kLength)
    return fmt::format(R"("ph":"C","args":{{"length":{}}})", event.length);
  if (event.kind == trace::Kind::kDropped)
    return fmt::format(R"("ph":"i","s":"t","args":{{{}}})", frame);
  return fmt::format(R"("ph":"X","dur":{},"args":{{{}{}"cpu_ms":{}}})", thousandths(event.wall_ns),
                     frame, frame.empty() ? "" : ",", thousandths(event.cpu_ns / 1000));
}

std::string event_text(const trace::Event& event, int thread, std::int64_t zero_ns) {
  return fmt::format(",\n{{\"name\":{},\"cat\":\"{}\",\"pid\":1,\"tid\":{},\"ts\":{},{}}}",
                     json_string(event_name(event)), event_category(event.kind), thread,
                     thousandths(event.begin_ns - zero_ns), event_details(event));
}

std::string thread_text(const std::string& name, int thread) {
  return fmt::format(
      ",\n{{\"name\":\"thread_name\",\"ph\":\"M\",\"pid\":1,\"tid\":{0},\"args\":{{\"name\":{1}}}}}"
      ",\n{{\"name\":\"thread_sort_index\",\"ph\":\"M\",\"pid\":1,\"tid\":{0},"
      "\"args\":{{\"sort_index\":{0}}}}}",
      thread, json_string(name));
}

}  // namespace

/// Those of all threads that were ever traced; one that ended leaves its buffer to the next of its
/// name, so that there are never more than threads at once.
class TraceBuffers : public trace::Tracer, public std::enable_shared_from_this<TraceBuffers> {
 public:
  explicit TraceBuffers(std::size_t capacity) : capacity_(capacity) {}

  [[nodiscard]] std::unique_ptr<trace::Track> track(const char* thread) override {
    const std::lock_guard lock(mutex_);
    for (const auto& buffer : buffers_)
      if (!buffer->in_use && buffer->name == thread)
        return std::make_unique<BufferTrack>(shared_from_this(), *buffer);
    buffers_.push_back(std::make_unique<Buffer>(thread, capacity_));
    return std::make_unique<BufferTrack>(shared_from_this(), *buffers_.back());
  }

  /// Takes out what is in the buffers. @param put a piece of the file, one buffer's at a time.
  template <typename Put>
  void take_all(const Put& put) {
    for (std::size_t i = 0; Buffer* const buffer = buffer_at(i); ++i) {
      const int thread = static_cast<int>(i) + 1;
      std::string text =
          std::exchange(buffer->is_told, true) ? "" : thread_text(buffer->name, thread);
      buffer->ring.take_all(
          [&](const trace::Event& event) { text += event_text(event, thread, zero_ns_); });
      if (!text.empty()) put(text);
    }
  }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_.load(); }

 private:
  /// One thread puts in, one takes out, neither waits.
  class EventRing {
   public:
    explicit EventRing(std::size_t capacity) : events_(std::bit_ceil(capacity)) {}

    /// @return false: it is full.
    bool put(const trace::Event& event) noexcept {
      const std::size_t end = end_.load(std::memory_order_relaxed);
      if (end - begin_.load(std::memory_order_acquire) == events_.size()) return false;
      events_[end & (events_.size() - 1)] = event;
      end_.store(end + 1, std::memory_order_release);
      return true;
    }
    template <typename Take>
    void take_all(const Take& take) {
      const std::size_t end = end_.load(std::memory_order_acquire);
      for (std::size_t i = begin_.load(std::memory_order_relaxed); i != end; ++i)
        take(events_[i & (events_.size() - 1)]);
      begin_.store(end, std::memory_order_release);
    }

   private:
    std::vector<trace::Event> events_;
    std::atomic<std::size_t> begin_{0}, end_{0};
  };

  struct Buffer {
    Buffer(const char* thread, std::size_t capacity) : name(thread), ring(capacity) {}
    const std::string name;
    EventRing ring;
    bool in_use = false;   // under the mutex
    bool is_told = false;  // of whoever takes out
  };
  class BufferTrack final : public trace::Track {
   public:
    /// Under the mutex.
    BufferTrack(std::shared_ptr<TraceBuffers> all, Buffer& own) : all_(std::move(all)), own_(own) {
      own_.in_use = true;
    }
    ~BufferTrack() override {
      const std::lock_guard lock(all_->mutex_);
      own_.in_use = false;
    }
    BufferTrack(const BufferTrack&) = delete;
    BufferTrack& operator=(const BufferTrack&) = delete;
    void add(const trace::Event& event) noexcept override {
      if (!own_.ring.put(event)) all_->dropped_.fetch_add(1, std::memory_order_relaxed);
    }

   private:
    const std::shared_ptr<TraceBuffers> all_;
    Buffer& own_;
  };

  /// Stays where it is. @return null where there are no more.
  [[nodiscard]] Buffer* buffer_at(std::size_t i) {
    const std::lock_guard lock(mutex_);
    return i < buffers_.size() ? buffers_[i].get() : nullptr;
  }

  const std::size_t capacity_;
  const std::int64_t zero_ns_ = trace::detail::now_ns();
  std::atomic<std::uint64_t> dropped_{0};
  std::mutex mutex_;
  std::vector<std::unique_ptr<Buffer>> buffers_;  // under the mutex
};

Status TraceWriter::check(const std::filesystem::path& path) {
  return check_growing_file(path, kTraceKind);
}

TraceWriter::TraceWriter(std::size_t capacity)
    : buffers_(std::make_shared<TraceBuffers>(capacity)) {}

TraceWriter::~TraceWriter() { static_cast<void>(finish()); }

trace::TracerPtr TraceWriter::tracer() const { return buffers_; }

std::uint64_t TraceWriter::dropped() const { return buffers_->dropped(); }

Status TraceWriter::start(const std::filesystem::path& path) {
  CHECK(!thread_, "a trace is of one file");
  auto file = create_growing_file(path, kTraceKind);
  if (!file.ok()) return file.error();
  path_ = path;
  file_ = std::move(file).value();
  put(std::string(kTraceBegin));
  thread_.emplace([this](const std::stop_token& stop) {
    static_cast<void>(
        ::setpriority(PRIO_PROCESS, 0, kTraceNice));  // of this thread alone, on Linux
    std::unique_lock lock(mutex_);
    while (!stop.stop_requested()) {
      write_what_came();
      wake_.wait_for(lock, stop, kWriteTraceEvery, [] { return false; });
    }
  });
  return Ok{};
}

Status TraceWriter::finish() {
  if (!file_) return failed_ ? Status(*failed_) : Ok{};
  thread_->request_stop();
  thread_->join();
  write_what_came();
  put(std::string(kTraceEnd));
  file_.reset();
  return failed_ ? Status(*failed_) : Ok{};
}

void TraceWriter::write_what_came() {
  buffers_->take_all([this](const std::string& text) { put(text); });
}

/// At once, so that it is there whatever ends the program; after the first fault nothing more.
void TraceWriter::put(const std::string& text) {
  if (failed_) return;
  if (std::fwrite(text.data(), 1, text.size(), file_.get()) == text.size() &&
      std::fflush(file_.get()) == 0)
    return;
  failed_ = Error{ErrorKind::kOutput, path_.string() + ": " + std::strerror(errno)};
}

}  // namespace ygslam
