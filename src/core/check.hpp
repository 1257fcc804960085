// CHECK(condition[, message]): a broken invariant is a bug; say where and give up what was begun.
#pragma once

#include <stdexcept>
#include <string>

namespace ygslam {

/// Caught at the borders only: the program ends with exit code 1, the library throws its Error.
class InternalError : public std::logic_error {
  using std::logic_error::logic_error;
};

namespace detail {
[[noreturn]] inline void check_failed(const char* file, int line, const char* condition,
                                      const char* message = "") {
  throw InternalError(std::string(file) + ":" + std::to_string(line) + ": CHECK(" + condition +
                      ") failed " + message);
}
}  // namespace detail
}  // namespace ygslam

#define CHECK(condition, ...)                                                             \
  do {                                                                                    \
    if (!(condition)) [[unlikely]]                                                        \
      ::ygslam::detail::check_failed(__FILE_NAME__, __LINE__, #condition, ##__VA_ARGS__); \
  } while (false)
