// A log.txt beside stderr, for the time of a command.
#pragma once

#include <spdlog/sinks/basic_file_sink.h>

#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include "core/log.hpp"
#include "core/result.hpp"

namespace ygslam {

class LogFile {
 public:
  /// @param truncate false: goes on where an earlier one ended. @return kOutput.
  static Result<LogFile> open(const std::filesystem::path& file, bool truncate) {
    try {
      return LogFile(std::make_shared<spdlog::sinks::basic_file_sink_mt>(file.string(), truncate));
    } catch (const spdlog::spdlog_ex& e) {
      return Error{ErrorKind::kOutput, file.string() + ": " + e.what()};
    }
  }
  LogFile(LogFile&&) = default;
  ~LogFile() {
    if (!sink_) return;
    spdlog::default_logger()->flush();
    std::erase(spdlog::default_logger()->sinks(), sink_);
  }

 private:
  explicit LogFile(spdlog::sink_ptr sink) : sink_(std::move(sink)) {
    spdlog::default_logger()->sinks().push_back(sink_);
    spdlog::default_logger()->flush_on(spdlog::level::info);  // a crash must not take the log along
  }
  spdlog::sink_ptr sink_;
};

}  // namespace ygslam
