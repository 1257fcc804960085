// Recorded sequences for Python, read by the code that reads them for `ygslam run`.
#pragma once

#include <nanobind/nanobind.h>

namespace ygslam::python {

void bind_sequence(nanobind::module_& m);

}  // namespace ygslam::python
