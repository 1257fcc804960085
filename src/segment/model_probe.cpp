#include "segment/model_probe.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <utility>

namespace ygslam {
namespace {

constexpr char kFine = '+';

/// Data segment in use [bytes], third from last number of /proc/self/statm.
std::uint64_t data_bytes() {
  unsigned long long pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(file, "%*u %*u %*u %*u %*u %llu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

void confine(const ChildLimits& limits) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int signal_number :
       {SIGINT, SIGTERM, SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGXCPU}) {
    signal(signal_number, SIG_DFL);
  }
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const rlim_t bytes = data_bytes() + limits.extra_bytes;
  const rlimit memory{bytes, bytes};
  setrlimit(RLIMIT_DATA, &memory);
  const auto cpu_s = static_cast<rlim_t>(limits.cpu.count());
  const rlimit cpu{cpu_s, cpu_s + 1};
  setrlimit(RLIMIT_CPU, &cpu);
  const int nowhere = open("/dev/null", O_RDWR | O_CLOEXEC);
  if (nowhere >= 0) {
    dup2(nowhere, STDOUT_FILENO);
    dup2(nowhere, STDERR_FILENO);
  }
}

/// One byte per error kind, then the text; a single kFine for success.
std::string encode(const Status& status) {
  if (status.ok()) return {kFine};
  return static_cast<char>(status.error().kind) + status.error().message;
}

[[noreturn]] void run_child(const std::function<Status()>& work, const std::string& name,
                            const ChildLimits& limits, int fd) {
  confine(limits);
  std::string answer;
  try {
    answer = encode(work());
  } catch (const std::exception& e) {
    answer = encode(Error{ErrorKind::kModel, name + ": " + e.what()});
  }
  const char* data = answer.data();
  std::size_t left = answer.size();
  while (left > 0) {
    const ssize_t n = write(fd, data, left);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    data += n;
    left -= static_cast<std::size_t>(n);
  }
  _exit(0);
}

/// Everything the child writes until it ends. @return false if it did not end in time.
bool read_answer(int fd, std::chrono::milliseconds timeout, std::string& answer) {
  const auto end = std::chrono::steady_clock::now() + timeout;
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        end - std::chrono::steady_clock::now());
    if (left.count() <= 0) return false;
    pollfd waiting{fd, POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(left.count()));
    if (ready < 0 && errno != EINTR) return false;
    if (ready <= 0) continue;
    char buffer[1024];
    const ssize_t n = read(fd, buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return true;
    answer.append(buffer, static_cast<std::size_t>(n));
  }
}

Status decode(const std::string& answer, int wait_status, const std::string& name) {
  if (answer.empty() && WIFSIGNALED(wait_status)) {
    const int signal_number = WTERMSIG(wait_status);
    const std::string what = signal_number == SIGXCPU
                                 ? "took too long"
                                 : "crashed (signal " + std::to_string(signal_number) + ")";
    return Error{ErrorKind::kModel, name + ": reading it " + what};
  }
  if (answer.empty()) {
    return Error{ErrorKind::kModel, name + ": reading it ended with exit code " +
                                        std::to_string(WEXITSTATUS(wait_status))};
  }
  if (answer[0] == kFine) return Ok{};
  return Error{static_cast<ErrorKind>(answer[0]), answer.substr(1)};
}

}  // namespace

Status try_in_child(const std::function<Status()>& work, const std::string& name,
                    const ChildLimits& limits) {
  int pipe_fds[2];
  if (pipe2(pipe_fds, O_CLOEXEC) != 0) {
    return Error{ErrorKind::kInternal, std::string("pipe: ") + std::strerror(errno)};
  }
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    close(pipe_fds[0]);
    run_child(work, name, limits, pipe_fds[1]);
  }
  close(pipe_fds[1]);
  if (child < 0) {
    close(pipe_fds[0]);
    return Error{ErrorKind::kInternal, std::string("fork: ") + std::strerror(errno)};
  }
  std::string answer;
  const bool in_time = read_answer(pipe_fds[0], limits.wall, answer);
  close(pipe_fds[0]);
  if (!in_time) kill(child, SIGKILL);
  int wait_status = 0;
  while (waitpid(child, &wait_status, 0) < 0 && errno == EINTR) {
  }
  if (!in_time) return Error{ErrorKind::kModel, name + ": reading it took too long"};
  return decode(answer, wait_status, name);
}

}  // namespace ygslam
