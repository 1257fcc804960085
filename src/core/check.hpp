// CHECK(condition[, message]): a broken invariant is a bug; say where and stop.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace ygslam::detail {
[[noreturn]] inline void check_failed(const char* file, int line, const char* condition,
                                      const char* message = "") {
  std::fprintf(stderr, "%s:%d: CHECK(%s) failed %s\n", file, line, condition, message);
  std::abort();
}
}  // namespace ygslam::detail

#define CHECK(condition, ...)                                                        \
  do {                                                                               \
    if (!(condition)) [[unlikely]]                                                   \
      ::ygslam::detail::check_failed(__FILE__, __LINE__, #condition, ##__VA_ARGS__); \
  } while (false)
