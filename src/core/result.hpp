// Three kinds of failure: a bug -> CHECK; bad input -> Result<T>; an expected outcome ->
// std::optional or a status enum.
#pragma once

#include <string>
#include <utility>
#include <variant>

#include "core/check.hpp"

namespace ygslam {

/// What kind of input was bad; the command line turns it into its exit code.
enum class ErrorKind {
  kInternal = 1,
  kUsage = 2,
  kConfig = 3,  ///< configuration or camera file
  kInput = 4,
  kModel = 5,
  kSavedMap = 6,
  kOutput = 9,
};

/// Exit code of a run that was lost for more than run.max_lost_share; its files are there.
inline constexpr int kExitLost = 7;

/// One line that names the file (or key) and the fault.
struct Error {
  ErrorKind kind = ErrorKind::kInternal;
  std::string message;
};

/// A value or the reason why there is none.
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}      // NOLINT: implicit by design
  Result(Error error) : state_(std::move(error)) {}  // NOLINT

  [[nodiscard]] bool ok() const { return std::holds_alternative<T>(state_); }
  explicit operator bool() const { return ok(); }

  [[nodiscard]] T& value() & {
    CHECK(ok(), error().message.c_str());
    return std::get<T>(state_);
  }
  [[nodiscard]] const T& value() const& {
    CHECK(ok(), error().message.c_str());
    return std::get<T>(state_);
  }
  [[nodiscard]] T&& value() && {
    CHECK(ok(), error().message.c_str());
    return std::move(std::get<T>(state_));
  }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  [[nodiscard]] const Error& error() const { return std::get<Error>(state_); }

 private:
  std::variant<T, Error> state_;
};

struct Ok {};
/// For operations that yield nothing but may fail.
using Status = Result<Ok>;

}  // namespace ygslam
