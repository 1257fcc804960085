// Wrong calls of constructors, told in one line as those of methods are (_calls.py).
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <string>

namespace ygslam::python {

/// The last overload of a constructor, for what fits none before it. Type checkers see that nothing
/// fits this one either.
template <typename Bound>
void tell_wrong_calls(Bound& bound) {
  using Self = typename Bound::Type;
  bound.def(
      "__init__",
      [](Self*, const nanobind::args& args, const nanobind::kwargs& given) {
        const auto calls = nanobind::module_::import_("ygslam._calls");
        const auto fault = calls.attr("constructor_fault")(nanobind::type<Self>(), args, given);
        throw nanobind::type_error(nanobind::cast<std::string>(fault).c_str());
      },
      nanobind::sig("def __init__(self, wrong: typing.Never, /, *args: typing.Never, **given: "
                    "typing.Never) -> None"));
}

}  // namespace ygslam::python
