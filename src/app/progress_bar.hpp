// How far long work has come, on standard error: a bar on a terminal, elsewhere (a pipe, a log of
// a build server) a plain line every ten seconds, so that nobody takes it for dead.
#pragma once

#include <unistd.h>

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <string>

#include "core/printable.hpp"

namespace ygslam {

class ProgressBar {
 public:
  /// @param total 0 where nobody knows: then there is no bar, but the lines are.
  ProgressBar(std::size_t total, bool quiet)
      : total_(total), quiet_(quiet), on_terminal_(isatty(STDERR_FILENO) != 0) {}
  ~ProgressBar() { clear(); }
  /// Takes the bar away, so that something else can be written.
  void clear() {
    if (drawn_) std::fprintf(stderr, "\r\033[K");
    drawn_ = false;
  }
  /// @param note may name what others named.
  void update(std::size_t done, const std::string& note) {
    if (quiet_) return;
    if (on_terminal_) {
      draw(done, one_line(note));
    } else {
      write_line(done, one_line(note));
    }
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kLinePeriod{10};

  void draw(std::size_t done, const std::string& note) {
    if (total_ == 0) return;
    const auto now = Clock::now();
    if (drawn_ && done < total_ && now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    drawn_ = true;
    constexpr std::size_t kWidth = 30;
    const std::size_t filled = kWidth * done / total_;
    std::fprintf(stderr, "\r\033[K[%s%s] %zu/%zu  %s", std::string(filled, '=').c_str(),
                 std::string(kWidth - filled, ' ').c_str(), done, total_, note.c_str());
    std::fflush(stderr);
  }
  /// As the log writes its lines, but not in log.txt.
  void write_line(std::size_t done, const std::string& note) {
    const auto now = Clock::now();
    if (now - last_ < kLinePeriod) return;
    last_ = now;
    const std::string of = total_ == 0 ? " so far" : " of " + std::to_string(total_);
    std::fprintf(stderr, "info: %zu%s, %s\n", done, of.c_str(), note.c_str());
  }

  std::size_t total_;
  bool quiet_;
  bool on_terminal_;
  bool drawn_ = false;
  Clock::time_point last_ = Clock::now();
};

}  // namespace ygslam
