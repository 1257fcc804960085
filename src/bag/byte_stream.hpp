// Bytes as they come: a pipe on standard input, a Unix socket.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <string>

#include "core/result.hpp"

namespace ygslam {

class ByteStream {
 public:
  /// Asked ten times a second while nothing comes: true ends the stream. May be empty.
  using Interrupted = std::function<bool()>;

  /// Standard input. @return kUsage where it is a terminal.
  static Result<ByteStream> standard_input(Interrupted interrupted);
  /// A Unix socket that another program listens at. @return kInput.
  static Result<ByteStream> unix_socket(const std::string& path, Interrupted interrupted);
  /// @param descriptor becomes the stream's own.
  ByteStream(int descriptor, std::string name, Interrupted interrupted);
  ByteStream(ByteStream&& other) noexcept;
  ByteStream& operator=(ByteStream&&) = delete;
  ~ByteStream();

  static constexpr std::chrono::seconds kForEver = std::chrono::hours(24 * 365 * 100);
  /// Waits until all of it is there. A stall is logged, and when it goes on.
  /// @param patience for more bytes. @return fewer bytes than asked for at the end, once stopped,
  /// or when patience is over.
  std::size_t read(std::span<std::uint8_t> to, const std::stop_token& stop,
                   std::chrono::seconds patience = kForEver);

  /// As it is called in messages.
  [[nodiscard]] const std::string& name() const { return name_; }
  /// Bytes so far.
  [[nodiscard]] std::uint64_t at() const { return at_; }
  /// It ended because somebody here wanted so.
  [[nodiscard]] bool was_stopped() const { return was_stopped_; }
  /// Why it ended, if not in good order.
  [[nodiscard]] const std::optional<std::string>& fault() const { return fault_; }

 private:
  bool wait(const std::stop_token& stop, std::chrono::seconds patience);

  int descriptor_;
  std::string name_;
  Interrupted interrupted_;
  std::uint64_t at_ = 0;
  bool was_stopped_ = false;
  std::optional<std::string> fault_;
};

}  // namespace ygslam
