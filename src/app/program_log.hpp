// The program's log: coloured lines on standard error and, during a run, the folder's log.txt.
#pragma once

#include <spdlog/spdlog.h>

#include <filesystem>

#include "core/log.hpp"
#include "core/result.hpp"
#include "system/frame_record.hpp"

namespace ygslam {

/// --quiet was given; it is the program's option, not the command's.
[[nodiscard]] inline bool is_quiet() { return spdlog::get_level() > spdlog::level::warn; }

/// To standard error and the open LogFile.
[[nodiscard]] log::SinkPtr program_log();

/// What a command wrote, on standard output, but not with --quiet.
void tell_written(const std::string& path);

/// A line that only -v shows.
void log_detail(const std::string& line);
/// The same, of a tracked frame: a FrameSink.
void log_frame(const FrameRecord& record, const TrackResult& result);

/// A log.txt beside standard error while it lives. It takes the place of an earlier one only when
/// place() is called; until then nothing of it is seen, and without it nothing remains.
class LogFile {
 public:
  /// @param continued begins with the lines of an earlier file, unless that is a link.
  /// @return kOutput.
  static Result<LogFile> open(const std::filesystem::path& file, bool continued = false);
  LogFile(LogFile&&) = default;
  ~LogFile();

  Status place();
  /// A line of the result: on standard output and in the file, but not with --quiet.
  void tell(const std::string& line);
  /// The last line is written. @return the first error of all lines.
  Status finish();

 private:
  class Sink;
  explicit LogFile(std::shared_ptr<Sink> sink);
  std::shared_ptr<Sink> sink_;
};

}  // namespace ygslam
