// What repr() says.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <string>

namespace ygslam::python {

/// Python's str.format().
template <typename... Values>
[[nodiscard]] std::string text(const char* format, const Values&... values) {
  return nanobind::cast<std::string>(nanobind::str(format).format(values...));
}

}  // namespace ygslam::python
