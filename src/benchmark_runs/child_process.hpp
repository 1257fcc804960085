// Another program as a child process: what it says on stderr is kept, and it never outlives us.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace ygslam {

/// How a child ended.
struct ChildExit {
  int exit_code = 0;  ///< 0 where a signal ended it
  int signal = 0;     ///< 0 where it ended by itself
  double wall_s = 0;
  double limit_s = 0;      ///< how long it was allowed to take, 0 = no limit; set by who waits
  bool timed_out = false;  ///< it was ended because that time was over
  std::string errors;      ///< the last 64 kB of its stderr
};

/// A running child. Its standard input is a file or empty, its standard output goes nowhere, its
/// stderr is collected by wait_for_any. The kernel ends it when this process dies.
class ChildProcess {
 public:
  /// @param arguments the program (looked for on the PATH where it has no slash) and what it gets.
  /// @param input file for its standard input; empty: none.
  /// @return kInternal if no process can be made; a program that cannot be started ends with
  /// exit code 127 and says why on its stderr.
  static Result<ChildProcess> start(const std::vector<std::string>& arguments,
                                    const std::filesystem::path& input = {});
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  /// Kills the child if it still runs.
  ~ChildProcess();

  void send(int signal) const;
  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] double age_s() const;
  /// Takes in what arrived on stderr. @return true once the child has closed it.
  bool read_errors();
  /// Waits for the end (which is near once stderr is closed). Call once.
  ChildExit finish();
  [[nodiscard]] int descriptor() const { return errors_fd_; }

 private:
  ChildProcess(pid_t pid, int errors_fd, double started_s)
      : pid_(pid), errors_fd_(errors_fd), started_s_(started_s) {}
  void abandon() noexcept;

  pid_t pid_ = -1;
  int errors_fd_ = -1;
  double started_s_ = 0;
  std::string errors_;
};

/// Waits until one of the children has ended or timeout_ms has passed; collects stderr meanwhile.
/// @return the index of a child that ended, -1 for none (also when a signal came).
[[nodiscard]] int wait_for_any(std::span<ChildProcess> children, int timeout_ms);

/// Asks all to end (SIGTERM), then makes them after patience_s.
void end_all(std::vector<ChildProcess>& children, double patience_s);

/// How long one that was asked to end (SIGTERM) may take for it before it is killed.
inline constexpr double kPatience_s = 5;

/// Runs a program to its end. @param stop asked a few times a second; true ends the child.
[[nodiscard]] Result<ChildExit> run_child(const std::vector<std::string>& arguments,
                                          const std::filesystem::path& input = {},
                                          const std::function<bool()>& stop = {});

/// What a person should read of a program's stderr: its last line with "error", else its last line;
/// without a leading "error: " or "warning: ", made safe for one line.
[[nodiscard]] std::string last_error_line(const std::string& errors);

}  // namespace ygslam
