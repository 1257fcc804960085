#include "benchmark_runs/child_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <optional>
#include <utility>

#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kErrorsKept = std::size_t{64} << 10;
constexpr int kExitCannotStart = 127;  // as shells have it

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// In the child between fork and exec: nothing but system calls.
[[noreturn]] void become(char* const* arguments, const char* input, int errors_fd, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kExitCannotStart);  // it died before the line above
  const int in = open(input, O_RDONLY | O_CLOEXEC);
  const int out = open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (in >= 0 && out >= 0 && dup2(in, STDIN_FILENO) >= 0 && dup2(out, STDOUT_FILENO) >= 0 &&
      dup2(errors_fd, STDERR_FILENO) >= 0) {
    execvp(arguments[0], arguments);
  }
  const char* reason = std::strerror(errno);
  for (const char* part : {"error: ", static_cast<const char*>(arguments[0]), ": ", reason, "\n"}) {
    if (write(errors_fd, part, std::strlen(part)) < 0) break;
  }
  _exit(kExitCannotStart);
}

}  // namespace

Result<ChildProcess> ChildProcess::start(const std::vector<std::string>& arguments,
                                         const std::filesystem::path& input) {
  CHECK(!arguments.empty());
  std::vector<char*> raw;
  raw.reserve(arguments.size() + 1);
  for (const std::string& argument : arguments) raw.push_back(const_cast<char*>(argument.c_str()));
  raw.push_back(nullptr);
  const std::string input_path = input.empty() ? "/dev/null" : input.string();
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    return Error{ErrorKind::kInternal, std::string("no pipe: ") + std::strerror(errno)};
  }
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) become(raw.data(), input_path.c_str(), ends[1], parent);
  const int code = errno;
  close(ends[1]);
  if (pid < 0) {
    close(ends[0]);
    return Error{ErrorKind::kInternal, std::string("no new process: ") + std::strerror(code)};
  }
  fcntl(ends[0], F_SETFL, O_NONBLOCK);
  return ChildProcess(pid, ends[0], now_s());
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      errors_fd_(std::exchange(other.errors_fd_, -1)),
      started_s_(other.started_s_),
      errors_(std::move(other.errors_)) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  if (this == &other) return *this;
  abandon();
  pid_ = std::exchange(other.pid_, -1);
  errors_fd_ = std::exchange(other.errors_fd_, -1);
  started_s_ = other.started_s_;
  errors_ = std::move(other.errors_);
  return *this;
}

ChildProcess::~ChildProcess() { abandon(); }

void ChildProcess::abandon() noexcept {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  if (errors_fd_ >= 0) close(errors_fd_);
  pid_ = errors_fd_ = -1;
}

void ChildProcess::send(int signal) const {
  if (pid_ > 0) kill(pid_, signal);
}

double ChildProcess::age_s() const { return now_s() - started_s_; }

bool ChildProcess::read_errors() {
  std::array<char, 4096> buffer{};
  for (;;) {
    const ssize_t count = read(errors_fd_, buffer.data(), buffer.size());
    if (count == 0) return true;
    if (count < 0) return errno != EAGAIN && errno != EINTR;
    errors_.append(buffer.data(), static_cast<std::size_t>(count));
    if (errors_.size() > 2 * kErrorsKept) errors_.erase(0, errors_.size() - kErrorsKept);
  }
}

ChildExit ChildProcess::finish() {
  CHECK(pid_ > 0);
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  ChildExit result;
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  result.wall_s = now_s() - started_s_;
  result.errors = std::move(errors_);
  return result;
}

int wait_for_any(std::span<ChildProcess> children, int timeout_ms) {
  std::vector<pollfd> polled;
  for (const ChildProcess& child : children) polled.push_back({child.descriptor(), POLLIN, 0});
  if (poll(polled.data(), polled.size(), timeout_ms) <= 0) return -1;
  for (std::size_t i = 0; i < polled.size(); ++i) {
    if (polled[i].revents != 0 && children[i].read_errors()) return static_cast<int>(i);
  }
  return -1;
}

void end_all(std::vector<ChildProcess>& children, double patience_s) {
  for (const ChildProcess& child : children) child.send(SIGTERM);
  const double until_s = now_s() + patience_s;
  while (!children.empty() && now_s() < until_s) {
    const int ended = wait_for_any(children, 100);
    if (ended < 0) continue;
    children[static_cast<std::size_t>(ended)].finish();
    children.erase(children.begin() + ended);
  }
  children.clear();  // kills what is left
}

Result<ChildExit> run_child(const std::vector<std::string>& arguments,
                            const std::filesystem::path& input, const std::function<bool()>& stop) {
  auto child = ChildProcess::start(arguments, input);
  if (!child.ok()) return child.error();
  std::optional<double> told_s;
  while (wait_for_any({&*child, 1}, 200) < 0) {
    if (!told_s && stop && stop()) {
      child->send(SIGTERM);
      told_s = now_s();
    } else if (told_s && now_s() - *told_s > kPatience_s) {
      child->send(SIGKILL);
      break;  // others may hold its stderr
    }
  }
  return child->finish();
}

std::string last_error_line(const std::string& errors) {
  std::string_view last, last_with_error;
  for (const TextLine& line : data_lines(errors)) {
    last = line.text;
    if (line.text.find("rror") != std::string_view::npos) last_with_error = line.text;
  }
  std::string_view chosen = last_with_error.empty() ? last : last_with_error;
  for (const std::string_view level : {"error: ", "warning: "}) {
    if (chosen.starts_with(level)) chosen.remove_prefix(level.size());
  }
  constexpr std::size_t kLongest = 400;
  return printable(chosen, kLongest);
}

}  // namespace ygslam
