#include "app/standard_streams.hpp"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>

#include "core/printable.hpp"
#include "core/result.hpp"

namespace ygslam {
namespace {

bool is_closed(int descriptor) { return ::fcntl(descriptor, F_GETFD) < 0 && errno == EBADF; }

/// A pipe or socket without a reader, a terminal that is gone, nothing at all.
bool nobody_reads(int descriptor) {
  pollfd asked{descriptor, POLLOUT, 0};
  if (::poll(&asked, 1, 0) > 0 && (asked.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0)
    return true;
  return (::fcntl(descriptor, F_GETFL) & O_ACCMODE) == O_RDONLY;  // settle_standard_streams()
}

}  // namespace

void settle_standard_streams() {
  // A new file gets the lowest number that is free. Reading from standard input and writing to the
  // others still fails, as it does where they are closed.
  for (const auto& [descriptor, mode] :
       {std::pair{STDIN_FILENO, O_WRONLY}, {STDOUT_FILENO, O_RDONLY}, {STDERR_FILENO, O_RDONLY}})
    if (is_closed(descriptor)) static_cast<void>(::open("/dev/null", mode));
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // what goes beyond a file size limit is then an error to report
}

void print_text(std::string_view text) {
  const std::string safe = several_lines(text);
  std::fwrite(safe.data(), 1, safe.size(), stdout);
}

int finish_standard_output(int code, bool is_product) {
  const bool is_written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  if (is_written) return code;
  const bool is_open = (::fcntl(STDOUT_FILENO, F_GETFL) & O_ACCMODE) != O_RDONLY;
  if (nobody_reads(STDOUT_FILENO)) {
    if (!is_product) return code;
    if (is_open) return code == 0 ? kExitReaderLeft : code;
  }
  std::fprintf(stderr, "error: standard output could not be written\n");
  return code == 0 ? static_cast<int>(ErrorKind::kOutput) : code;
}

}  // namespace ygslam
