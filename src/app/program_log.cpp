#include "app/program_log.hpp"

#include <fmt/format.h>
#include <spdlog/sinks/base_sink.h>

#include <mutex>

#include "app/standard_streams.hpp"
#include "core/printable.hpp"
#include "io/atomic_file.hpp"
#include "io/text.hpp"

namespace ygslam {

log::SinkPtr program_log() {
  return std::make_shared<const log::Sink>([](log::Level level, const std::string& line) {
    spdlog::log(level == log::Level::kError     ? spdlog::level::err
                : level == log::Level::kWarning ? spdlog::level::warn
                                                : spdlog::level::info,
                spdlog::string_view_t(one_line(line)));
  });
}

void tell_written(const std::string& path) {
  if (!is_quiet()) print_text("written: {}\n", one_line(path));
}

void log_detail(const std::string& line) {
  spdlog::log(spdlog::level::debug, spdlog::string_view_t(one_line(line)));
}

void log_frame(const FrameRecord& record, const TrackResult& result) {
  if (!spdlog::should_log(spdlog::level::debug)) return;
  const std::string mask = record.mask_age_frames < 0
                               ? "no mask"
                               : fmt::format("a mask {} frames old", record.mask_age_frames);
  log_detail(
      fmt::format("frame {}: {}, {} matches, {} inliers, {} static and {} dynamic points, "
                  "{}, {:.1f} ms{}",
                  index(record.frame), to_string(record.state), record.matches, record.inliers,
                  record.static_points, record.dynamic_points, mask, record.track_ms,
                  result.candidate ? ", a keyframe" : ""));
}

// Line by line, so that a crash does not take the log along.
class LogFile::Sink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit Sink(AtomicFile file) : file_(std::move(file)) {}

  Status place() {
    const std::lock_guard lock(mutex_);
    return file_.place();
  }
  Status finish() {
    const std::lock_guard lock(mutex_);
    if (!failure_.ok()) return failure_;
    return file_.commit();
  }
  void write(std::string_view text) {
    if (failure_.ok()) failure_ = file_.write(text);
  }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    write({line.data(), line.size()});
  }
  void flush_() override {}

 private:
  AtomicFile file_;
  Status failure_ = Ok{};
};

Result<LogFile> LogFile::open(const std::filesystem::path& path, bool continued) {
  auto file = AtomicFile::create(path);
  if (!file.ok()) return file.error();
  const auto sink = std::make_shared<Sink>(std::move(*file));
  std::error_code code;
  if (continued && std::filesystem::is_regular_file(std::filesystem::symlink_status(path, code))) {
    if (const auto earlier = read_file(path); earlier.ok()) sink->write(*earlier);
  }
  return LogFile(sink);
}

LogFile::LogFile(std::shared_ptr<Sink> sink) : sink_(std::move(sink)) {
  spdlog::default_logger()->sinks().push_back(sink_);
}

LogFile::~LogFile() {
  if (sink_) std::erase(spdlog::default_logger()->sinks(), sink_);
}

void LogFile::tell(const std::string& line) {
  if (is_quiet()) return;
  const std::string safe = one_line(line);
  print_text("{}\n", safe);
  sink_->log({"ygslam", spdlog::level::info, safe});
}

Status LogFile::place() { return sink_->place(); }
Status LogFile::finish() {
  std::erase(spdlog::default_logger()->sinks(), sink_);
  return sink_->finish();
}

}  // namespace ygslam
