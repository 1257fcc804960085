#include "bag/byte_stream.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "core/log.hpp"

namespace ygslam {
namespace {

constexpr auto kStall = std::chrono::seconds(2);
constexpr int kLookUp_ms = 100;      // for an interruption, which wakes nobody
constexpr int kPipeBytes = 1 << 20;  // an image at once, as far as the system allows it
constexpr std::size_t kReadBytes = 1 << 20;

}  // namespace

Result<ByteStream> ByteStream::standard_input(Interrupted interrupted) {
  if (::isatty(STDIN_FILENO) != 0)
    return Error{ErrorKind::kUsage,
                 "standard input is a terminal: an MCAP stream is to be piped into it"};
  const int descriptor = ::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 0);
  if (descriptor < 0)
    return Error{ErrorKind::kInput, std::string("standard input: ") + std::strerror(errno)};
  return ByteStream(descriptor, "standard input", std::move(interrupted));
}

Result<ByteStream> ByteStream::unix_socket(const std::string& path, Interrupted interrupted) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const auto fault = [&](const char* what) {
    return Error{ErrorKind::kInput, "unix:" + path + ": " + what};
  };
  if (path.empty() || path.size() >= sizeof address.sun_path)
    return fault("is no path of a socket");
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  ByteStream stream(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0), "unix:" + path,
                    std::move(interrupted));
  if (::connect(stream.descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) !=
      0)
    return fault(std::strerror(errno));
  return stream;
}

ByteStream::ByteStream(int descriptor, std::string name, Interrupted interrupted)
    : descriptor_(descriptor), name_(std::move(name)), interrupted_(std::move(interrupted)) {
  ::fcntl(descriptor_, F_SETPIPE_SZ, kPipeBytes);  // of no consequence where it is no pipe
}

ByteStream::ByteStream(ByteStream&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      name_(std::move(other.name_)),
      interrupted_(std::move(other.interrupted_)),
      at_(other.at_),
      was_stopped_(other.was_stopped_),
      fault_(std::move(other.fault_)) {}

ByteStream::~ByteStream() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

/// @return false once stopped, or when patience is over.
bool ByteStream::wait(const std::stop_token& stop, std::chrono::seconds patience) {
  const auto began = std::chrono::steady_clock::now();
  bool is_told = false;
  for (;;) {
    was_stopped_ = stop.stop_requested() || (interrupted_ && interrupted_());
    if (was_stopped_) return false;
    pollfd waiting{descriptor_, POLLIN, 0};
    const int ready = ::poll(&waiting, 1, kLookUp_ms);
    const auto waited = std::chrono::steady_clock::now() - began;
    if (ready > 0 || (ready < 0 && errno != EINTR)) {  // what is wrong shows when it is read
      if (is_told)
        log::info("{}: goes on after {:.1f} s", name_,
                  std::chrono::duration<double>(waited).count());
      return true;
    }
    if (waited >= patience) return false;
    if (waited >= kStall && !std::exchange(is_told, true))
      log::warn("{}: nothing has come for {} s; waiting", name_, kStall.count());
  }
}

std::size_t ByteStream::read(std::span<std::uint8_t> to, const std::stop_token& stop,
                             std::chrono::seconds patience) {
  std::size_t got = 0;
  while (got < to.size() && !fault_ && wait(stop, patience)) {
    const ssize_t n = ::read(descriptor_, to.data() + got, std::min(to.size() - got, kReadBytes));
    if (n < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (n < 0) fault_ = std::strerror(errno);
    if (n <= 0) break;
    got += static_cast<std::size_t>(n);
    at_ += static_cast<std::uint64_t>(n);
  }
  return got;
}

}  // namespace ygslam
