// A progress line on stderr, only when that is a terminal.
#pragma once

#include <unistd.h>

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <string>

namespace ygslam {

class ProgressBar {
 public:
  ProgressBar(std::size_t total, bool quiet)
      : total_(total), shown_(!quiet && isatty(STDERR_FILENO) != 0) {}
  ~ProgressBar() { clear(); }
  /// Takes the line away, so that something else can be written.
  void clear() {
    if (drawn_) std::fprintf(stderr, "\r\033[K");
    drawn_ = false;
  }
  void update(std::size_t done, const std::string& note) {
    if (!shown_ || total_ == 0) return;
    const auto now = std::chrono::steady_clock::now();
    if (drawn_ && done < total_ && now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    drawn_ = true;
    constexpr std::size_t kWidth = 30;
    const std::size_t filled = kWidth * done / total_;
    std::fprintf(stderr, "\r\033[K[%s%s] %zu/%zu  %s", std::string(filled, '=').c_str(),
                 std::string(kWidth - filled, ' ').c_str(), done, total_, note.c_str());
    std::fflush(stderr);
  }

 private:
  std::size_t total_;
  bool shown_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace ygslam
